//! Runs beside one of the next order over the same steps, given up as soon as they are too far apart.
//!
//! Where every step is made by Newton's method a run is dear, and a step from the start of the motion says little about the rest of it. So no step is probed and no run is compared
//! with one of longer steps: two elements go side by side from the first step on, their distance is the error of the lower one (T-98), and steps that are too long, or much too
//! short, are noticed on the way.

use super::super::estimated::{Attempt, Picked};
use super::super::pilot::corners;
use super::super::trace::difference;
use super::runs::{
    AIM, Asked, Beside, Climbed, FIRST, Found, MOST_RUNS, RESOLVED, ROUNDINGS, Runner, TIGHTEST,
    Way, largest, next,
};
use crate::error::RunErrorKind;
use crate::numbers::larger;
use std::ops::ControlFlow;
use tfe_runtime::{Element, Statistics};

/// Errors stay below what is asked by this factor: the better run has an error, too.
const SAFE: f64 = 1.1;
/// Two elements that are farther apart may both be wrong: more is not aimed at.
const LOOSEST: f64 = 0.01;
/// What iterations of the better run may leave of what those of the other may: a comparison is not spoilt by it.
const LEFT_BESIDE: f64 = 0.01;
/// Steps that have come that far, in parts of the span, are not given up for longer ones.
const EARLY: f64 = 0.35;
/// Steps are not given up for longer ones before that.
const NOT_EARLIER: f64 = 0.1;
/// How much less a run with longer steps has to cost, what has been done included.
const WORTH: f64 = 0.8;
/// By how much longer steps become at once.
const MOST_LONGER: f64 = 3.0;
/// By how much shorter.
const MOST_SHORTER: f64 = 0.3;
/// After a step that fails, or of which both elements know nothing.
const FAILED: f64 = 0.5;
/// By how much shorter at least.
const BELOW: f64 = 0.87;
/// Errors that will be larger by this factor, if they go on growing with the time, are not waited for.
const FORESEEN: f64 = 4.0;
/// From when on that is known: if they grow with the time, and if they grow as they have done.
const FORESEEN_FROM: [f64; 2] = [0.1, 0.4];
/// The power of the time with which errors are expected to grow where that was not measured.
const GROWTH: f64 = 1.5;
/// No more is believed of what was measured from the start on, and after a good part of the span.
const MOST_GROWTH: [f64; 2] = [2.0, 4.0];
/// Steps that are to be much shorter become a little shorter still, by this power of the factor: errors fall with less than their order where steps are long.
const EXTRAPOLATED: f64 = 0.1;
/// Runs, those included that were given up at their start: a step that is halved as often is nothing.
const MOST_STARTS: usize = 40;
/// Shorter steps that have not brought the runs closer.
const MOST_FLOORS: u32 = 3;

/// The element for an accuracy where Newton's method makes every step: a step costs more than in proportion to its points, so fewer of them pay than where a fixed point is iterated.
/// On the mechanisms of `tests/constraints/small_steps.rs` these, or those of a node less, take the least time in most cases.
pub(super) fn element_for(accuracy: f64) -> Element {
    let nodes = match accuracy {
        a if a > 3e-5 => 4,
        a if a > 3e-8 => 5,
        a if a > 3e-11 => 6,
        _ => 8,
    };
    Element::mixed(nodes)
}

/// What a run was given up for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    Shorter(f64),
    Longer(f64),
}

/// Looks at two runs on their way.
struct Judge {
    accuracy: f64,
    order: f64,
    /// By how much longer steps may become.
    most_longer: f64,
    /// Whether the run is made to its end, whatever it is off by.
    is_last: bool,
    /// The largest number of each kind in all runs.
    sizes: Vec<f64>,
    error: f64,
    /// The part of the span that is done.
    done: f64,
    /// Both, at every node so far.
    passed: Vec<(f64, f64)>,
}

impl Judge {
    /// Gives up what is too far off, or too exact.
    fn look(&mut self, done: f64, beside: &Beside<'_>) -> Option<Verdict> {
        self.sizes.resize(beside.sizes.len(), 0.0);
        let mut error = self.error;
        for ((size, now), apart) in self.sizes.iter_mut().zip(beside.sizes).zip(beside.apart) {
            *size = size.max(*now);
            if *apart != 0.0 {
                error = larger(error, apart / *size);
            }
        }
        (self.error, self.done) = (error, done);
        self.passed.push((done, error));
        if self.is_last {
            return None;
        }
        let [early, late] = FORESEEN_FROM;
        let foreseen = if done >= late {
            self.foreseen(MOST_GROWTH[1])
        } else if done >= early {
            error / done
        } else {
            0.0
        };
        if !(error <= self.accuracy && foreseen <= FORESEEN * self.accuracy) {
            return Some(Verdict::Shorter(self.shorter()));
        }
        // At the start a motion may be slow.
        let end = larger(error, f64::EPSILON) / (done * done);
        let longer = (self.accuracy / end).powf(1.0 / self.order) / AIM;
        let longer = longer.min(self.most_longer);
        let is_early = (NOT_EARLIER..=EARLY).contains(&done);
        (is_early && 1.0 / longer < WORTH * (1.0 - done)).then_some(Verdict::Longer(longer))
    }

    /// The factor of steps that are off by no more than is asked.
    fn shorter(&self) -> f64 {
        if !(self.error <= RESOLVED) {
            return FAILED;
        }
        let factor = (self.accuracy / self.foreseen(MOST_GROWTH[0])).powf(1.0 / self.order);
        (factor.powf(1.0 + EXTRAPOLATED) / AIM).clamp(MOST_SHORTER, BELOW)
    }

    /// The error at the end of the span, if errors go on growing with the power of the time with which they have, between 1 and `most`.
    fn foreseen(&self, most: f64) -> f64 {
        let Self { error, done, .. } = *self;
        let half = self.passed.partition_point(|(then, _)| *then < 0.5 * done);
        let Some(&(then, before)) = self.passed.get(half).filter(|(then, _)| *then < done) else {
            return error * done.powf(-GROWTH);
        };
        let power = (error / before).ln() / (done / then).ln();
        // Of zero, or no number.
        let power = if power.is_finite() {
            power.clamp(1.0, most)
        } else {
            GROWTH
        };
        error * done.powf(-power)
    }
}

/// Runs in pairs until one is off by no more than is asked.
///
/// # Errors
/// What stops runs of every step.
pub(super) fn climb(
    asked: &Asked,
    way: Way<'_>,
    run: &mut dyn Runner,
    most_steps: f64,
) -> Result<Option<Climbed>, RunErrorKind> {
    let Some(better) = next(way.element) else {
        return Ok(None);
    };
    let mut cuts = vec![asked.span.start];
    cuts.extend(corners(&asked.span, &asked.breaks));
    let mut way = Way {
        cuts: &cuts,
        keeps: true,
        ..way
    };
    let (length, longest) = way.lengths(asked);
    way.step = longest.min(length / FIRST);
    let mut too_long = f64::INFINITY;
    let mut attempts: Vec<Attempt> = Vec::new();
    let mut judge = Judge {
        accuracy: (asked.accuracy / SAFE).min(LOOSEST),
        order: way.element.order() as f64,
        most_longer: 1.0,
        is_last: false,
        sizes: Vec::new(),
        error: 0.0,
        done: 0.0,
        passed: Vec::new(),
    };
    let (mut failure, mut errors) = (None, None);
    // The error that the whole of a run with longer steps would have had.
    let mut before: Option<f64> = None;
    let (mut floors, mut tightened) = (0, 1.0);
    let mut runs = 0;
    for _ in 0..MOST_STARTS {
        if length / way.step > most_steps {
            let step = way.step;
            return Ok(Some(Climbed::TooMany { attempts, step }));
        }
        // What was given up early was no run.
        runs += usize::from(judge.done >= NOT_EARLIER);
        judge.is_last = runs + 1 >= MOST_RUNS || floors == MOST_FLOORS;
        // Half of the way to steps that were too long, if there were any.
        judge.most_longer = (MOST_LONGER.min(longest / way.step)).min((too_long / way.step).sqrt());
        (judge.error, judge.done) = (0.0, 0.0);
        judge.passed.clear();
        way.tolerance = (tightened * asked.tolerance(length / way.step)).max(TIGHTEST);
        let other = Way {
            element: better,
            tolerance: (LEFT_BESIDE * way.tolerance).max(TIGHTEST),
            ..way.clone()
        };
        let taken = way.taken();
        let mut verdict = None;
        let ran = run.run_beside(&way, &other, &mut |beside| {
            let done = way.between(asked.span.start, beside.time) / length;
            verdict = judge.look(done, beside);
            match verdict {
                Some(_) => ControlFlow::Break(()),
                None => ControlFlow::Continue(()),
            }
        });
        let mut told = Attempt {
            step: taken,
            error_estimate: None,
        };
        let ran = match ran {
            Err(failed) if failed.is_final_after(failure.as_ref()) => return Err(failed.kind),
            Err(failed) if failure.is_some() && failed.is_unresolved() => break,
            Err(failed) => {
                attempts.push(told);
                failure = Some(failed.kind);
                too_long = taken;
                way.step = taken * FAILED;
                continue;
            }
            Ok(ran) => ran,
        };
        told.error_estimate = Some(judge.error);
        let [first, second] = &ran.traces;
        if ran.is_complete && verdict.is_none() {
            let seen = difference(first, second);
            let error = largest(&seen);
            told.error_estimate = Some(error);
            attempts.push(told);
            let is_enough = error <= judge.accuracy;
            errors = Some((ran.times, seen, error <= asked.accuracy / SAFE));
            if is_enough || judge.is_last {
                break;
            }
            verdict = Some(Verdict::Shorter(judge.shorter()));
        } else {
            attempts.push(told);
        }
        match verdict {
            Some(Verdict::Longer(factor)) => way.step = (factor * taken).min(longest),
            Some(Verdict::Shorter(factor)) => {
                let foreseen = judge.foreseen(MOST_GROWTH[0]);
                if before.is_some_and(|before| foreseen > 0.5 * before) && judge.error < ROUNDINGS {
                    floors += 1;
                    tightened *= 1e-2;
                }
                before = Some(foreseen);
                too_long = taken;
                way.step = factor * taken;
            }
            None => break,
        }
    }
    let Some((times, errors, is_met)) = errors else {
        return Err(failure.unwrap_or(RunErrorKind::Step { step: way.step }));
    };
    let extremes = way.measure(&mut attempts);
    Ok(Some(Climbed::Found(Box::new(Found {
        is_met,
        picked: Picked {
            element: way.element,
            step: extremes.1,
            shortest: extremes.0,
            tolerance: way.tolerance,
            solve: asked.solve,
            accuracy: asked.accuracy,
            error_estimate: largest(&errors),
            attempts,
            work: Statistics::NONE,
        },
        times,
        errors,
    }))))
}
