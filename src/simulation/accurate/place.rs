//! Where runs with shorter and shorter steps stop, and whether the motion goes on from there.

use super::repeatable::{Repeatable, trusting};
use crate::accuracy::{Trace, Way};
use crate::error::RunErrorKind;
use crate::simulation::mesh::Mesh;

/// Where runs with shorter and shorter steps stop.
#[derive(Debug, Default)]
pub(super) struct Place {
    last: Option<(f64, f64)>,
    /// How many runs in succession have stopped there.
    times: u32,
}

impl Place {
    /// How many runs in succession have stopped within a step or two of the same time, this one included; none where that is the start's.
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

    /// Whether steps of any length stop there: runs have done so again and again, and the motion does not go on.
    pub(super) fn is_an_end<R: Repeatable<N>, const N: usize>(
        &mut self,
        run: &R,
        start: f64,
        (way, mesh): (&Way<'_>, &Mesh<N>),
        stopped: (&RunErrorKind, &R::State),
    ) -> bool {
        /// How many runs are enough to look beyond, and from when on steps are so much shorter that two lengths of them have to tell the same motion.
        const OFTEN: [u32; 2] = [3, 8];
        let times = self.meet(start, stopped.0);
        let [often, very_often] = OFTEN;
        times >= often && !is_passed(run, way, mesh, stopped, times >= very_often)
    }
}

/// Whether the motion goes on beyond a time at which a run has stopped, with steps that are as short as they have to be.
///
/// It does not where it ends in a singular point. Nor does it where steps get across one by chance, if that is looked at: two runs with steps of different lengths are at different
/// places then.
fn is_passed<R: Repeatable<N>, const N: usize>(
    run: &R,
    way: &Way<'_>,
    mesh: &Mesh<N>,
    (kind, state): (&RunErrorKind, &R::State),
    compares: bool,
) -> bool {
    const OTHER: f64 = 0.618;
    /// Two runs that are farther apart, relative to the largest number of their kind, do not tell the same motion.
    const SAME: f64 = 0.1;
    let &RunErrorKind::Solve { time, step, .. } = kind else {
        return true;
    };
    let control = trusting(run.control());
    let Ok(mut stepper) = run.stepper(way.element, control, false) else {
        return true;
    };
    let mut trace = Trace::new(run.coordinates(), run.columns());
    let mut rows = [vec![0.0; trace.width()], vec![0.0; trace.width()]];
    let [row, _] = &mut rows;
    run.row(&mut stepper, &run.at(time, state), row);
    trace.pass(row, 0, false);
    for (row, first) in rows.iter_mut().zip([step, OTHER * step]) {
        match beyond(run, &mut stepper, mesh, (time, step, first), state) {
            Beyond::Reached(end, state) => run.row(&mut stepper, &run.at(end, &state), row),
            Beyond::Stopped => return false,
            Beyond::Unknown => return true,
        }
    }
    if !compares {
        return true;
    }
    let [one, other] = &rows;
    let (mut apart, mut sizes) = (Vec::new(), Vec::new());
    trace.apart(one, other, &mut apart);
    trace.sizes_with(one, &mut sizes);
    let mut kinds = apart.iter().zip(&sizes);
    kinds.all(|(apart, size)| *apart <= SAME * size)
}

/// What there is beyond a time at which a run has stopped.
enum Beyond<S> {
    Reached(f64, S),
    Stopped,
    /// Steps have become many and not so short that they could get no shorter.
    Unknown,
}

/// Some steps of a run from a time on, cut as often as they have to be, the first one of the length `first`.
fn beyond<R: Repeatable<N>, const N: usize>(
    run: &R,
    stepper: &mut R::Stepper,
    mesh: &Mesh<N>,
    (time, step, first): (f64, f64, f64),
    state: &R::State,
) -> Beyond<R::State> {
    /// How far, in steps of the run.
    const FAR: f64 = 4.0;
    const MOST: u32 = 2000;
    /// Sums of steps may be off by roundings, which are no steps of their own.
    const ROUNDINGS: f64 = 1.0 - 1e-9;
    let end = time + FAR * step;
    let (mut t, mut h, mut state) = (time, first, state.clone());
    for _ in 0..MOST {
        let is_last = h.abs() >= ROUNDINGS * (end - t).abs();
        let next = if is_last { end } else { t + h };
        if next == t {
            return Beyond::Stopped;
        }
        let mut moved = state.clone();
        match run.advance(stepper, (t, next, next - t), mesh, &mut moved) {
            Ok(()) if is_last => return Beyond::Reached(end, moved),
            Ok(()) => {
                (t, state) = (next, moved);
                h = if first.abs() > 2.0 * h.abs() {
                    2.0 * h
                } else {
                    first
                };
            }
            Err(_) if is_last => h = (next - t) / 2.0,
            Err(_) => h /= 2.0,
        }
    }
    Beyond::Unknown
}
