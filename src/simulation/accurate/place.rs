//! Detects a time that runs cannot pass with any step size, such as a singularity of the motion.

use super::repeatable::{Repeatable, Stepping, trusting};
use crate::accuracy::{RunSettings, Trace};
use crate::error::RunErrorKind;
use crate::simulation::times::Times;

/// The time at which successive runs with decreasing step size have failed.
#[derive(Debug, Default)]
pub(super) struct Place {
    last: Option<(f64, f64)>,
    /// The number of successive runs that failed there.
    times: u32,
}

impl Place {
    /// Counts the successive runs that failed within two steps of the same time, including this one. A failure at the
    /// start of the span always counts as the first.
    fn meet(&mut self, start: f64, kind: &RunErrorKind) -> u32 {
        let &RunErrorKind::Solve { time, step, .. } = kind else {
            return 0;
        };
        let is_same = |&(t, h): &(f64, f64)| (time - t).abs() <= 2.0 * h.abs().max(step.abs());
        self.times = match self.last {
            Some(last) if time != start && is_same(&last) => self.times + 1,
            _ => 1,
        };
        self.last = Some((time, step));
        self.times
    }

    /// Whether no step size leads past the time of failure: several runs have failed there, and trial steps do not get
    /// beyond it.
    pub(super) fn is_an_end(
        &mut self,
        run: &dyn Repeatable,
        (settings, mesh): (&RunSettings<'_>, &Times),
        stopped: (&RunErrorKind, &[f64]),
    ) -> bool {
        /// The number of failures after which trial steps are made, and the number after which two step sizes must also
        /// agree on the motion beyond.
        const OFTEN: [u32; 2] = [3, 8];
        let (start, _) = run.given().start;
        let times = self.meet(start, stopped.0);
        let [often, very_often] = OFTEN;
        times >= often && !is_passed(run, settings, mesh, stopped, times >= very_often)
    }
}

/// Whether the motion continues beyond the time at which a run failed, when steps are halved as often as needed.
///
/// It does not if it ends in a singularity. With `compares`, it does not either if steps get across a singularity only
/// by chance: a step and two of half its length then end in different states however short they are, and so do two runs
/// with different step sizes. Steps across a regular but fast part of the motion, such as a close encounter, agree when
/// they are short enough.
fn is_passed(
    run: &dyn Repeatable,
    settings: &RunSettings<'_>,
    mesh: &Times,
    (kind, state): (&RunErrorKind, &[f64]),
    compares: bool,
) -> bool {
    const OTHER: f64 = 0.618;
    /// The largest difference, relative to the largest number of the same kind, of two runs that agree.
    const SAME: f64 = 0.1;
    let &RunErrorKind::Solve { time, step, .. } = kind else {
        return true;
    };
    let given = run.given();
    let Ok(stepper) = run.stepper(settings.element, trusting(given.control), false) else {
        return true;
    };
    let mut passage = Passage {
        stepper,
        mesh,
        seen: compares.then(|| Trace::new(given.coordinates, 0)),
    };
    let mut trace = given.trace();
    let mut rows = [vec![0.0; trace.width()], vec![0.0; trace.width()]];
    let [row, _] = &mut rows;
    passage.stepper.place(time, state);
    passage.stepper.row(row);
    trace.pass(row, 0, false);
    for (row, first) in rows.iter_mut().zip([step, OTHER * step]) {
        match passage.beyond((time, step, first), state) {
            Beyond::Reached => passage.stepper.row(row),
            Beyond::Stopped => return false,
            Beyond::Unknown => return true,
        }
    }
    !compares || agree(&trace, &rows, SAME)
}

/// Whether two rows of numbers differ by at most `most`, relative to the largest number of the same kind.
fn agree(trace: &Trace, [one, other]: &[Vec<f64>; 2], most: f64) -> bool {
    let (mut differences, mut sizes) = (Vec::new(), Vec::new());
    trace.differences(one, other, &mut differences);
    trace.sizes_with(one, &mut sizes);
    let mut kinds = differences.iter().zip(&sizes);
    kinds.all(|(differences, size)| *differences <= most * size)
}

/// The outcome of trial steps beyond a time at which a run has failed.
enum Beyond {
    /// The stepper is at the end of the trial.
    Reached,
    Stopped,
    /// The limit on the number of steps was reached before the steps became too short for the resolution of time.
    Unknown,
}

/// Steps beyond a time at which a run has failed.
struct Passage<'a> {
    stepper: Box<dyn Stepping + 'a>,
    mesh: &'a Times,
    /// The states so far, if every step is compared with two of half its length.
    seen: Option<Trace>,
}

impl Passage<'_> {
    /// Makes steps from `time` on, the first of length `first`, each shortened as often as it fails.
    fn beyond(&mut self, (time, step, first): (f64, f64, f64), state: &[f64]) -> Beyond {
        /// The length of the trial, in steps of the failed run.
        const FAR: f64 = 4.0;
        const MAX: u32 = 2000;
        /// A remainder shorter than this relative amount of a step is rounding error, and gets no step of its own.
        const ROUNDINGS: f64 = 1.0 - 1e-9;
        let end = time + FAR * step;
        let (mut t, mut h, mut state) = (time, first, state.to_vec());
        for _ in 0..MAX {
            let is_last = h.abs() >= ROUNDINGS * (end - t).abs();
            let next = if is_last { end } else { t + h };
            if next == t {
                return Beyond::Stopped;
            }
            match self.step(t, next, &state) {
                Some(_) if is_last => return Beyond::Reached,
                Some(reached) => {
                    (t, state) = (next, reached);
                    h = if first.abs() > 2.0 * h.abs() {
                        2.0 * h
                    } else {
                        first
                    };
                }
                None if is_last => h = (next - t) / 2.0,
                None => h /= 2.0,
            }
        }
        Beyond::Unknown
    }

    /// The state that a step reaches. `None` if it fails, or if two steps of half its length end elsewhere and these
    /// are to be compared.
    fn step(&mut self, t: f64, next: f64, state: &[f64]) -> Option<Vec<f64>> {
        /// The largest relative difference between a step and two of half its length that agree.
        const SAME: f64 = 1e-6;
        let whole = self.end_of(&[t, next], state)?;
        let Some(mut seen) = self.seen.take() else {
            return Some(whole);
        };
        seen.pass(state, 0, false);
        let halves = self.end_of(&[t, t + (next - t) / 2.0, next], state);
        let reached = halves.filter(|halves| agree(&seen, &[whole, halves.clone()], SAME));
        self.seen = Some(seen);
        reached
    }

    /// The state at the last of the times, by one step from each to the next; `None` if one fails.
    fn end_of(&mut self, times: &[f64], state: &[f64]) -> Option<Vec<f64>> {
        self.stepper.place(times[0], state);
        for ends in times.windows(2) {
            let (from, to) = (ends[0], ends[1]);
            let element = (from, to, to - from);
            self.stepper.advance(self.mesh, element).ok()?;
        }
        Some(self.stepper.state())
    }
}
