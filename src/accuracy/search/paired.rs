//! Runs in pairs: two elements of successive orders over the same steps, abandoned as soon as their difference is too
//! large.
//!
//! If Newton's method solves every step, runs are expensive, and a step at the start of the motion says little about
//! the rest. There is no probe then, and no comparison of runs with different steps: two elements run side by side from
//! the first step on. Their difference is the error of the lower one (T-98), and steps that are too long, or much too
//! short, are detected during the run.

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

/// Safety factor of the error, since the more accurate run has an error, too.
const SAFE: f64 = 1.1;
/// The largest accuracy aimed at: with a larger difference both elements may be wrong.
const LOOSEST: f64 = 0.01;
/// The tolerance of the more accurate run, relative to that of the other one, so that the comparison is not affected.
const LEFT_BESIDE: f64 = 0.01;
/// The fraction of the span after which a run is no longer abandoned for longer steps.
const EARLY: f64 = 0.35;
/// The fraction of the span before which a run is not yet abandoned for longer steps.
const NOT_EARLIER: f64 = 0.1;
/// The largest cost of a run with longer steps, relative to that of completing this one, for which it is abandoned.
const WORTH: f64 = 0.8;
/// The largest increase of the step at once.
const MOST_LONGER: f64 = 3.0;
/// The largest reduction of the step at once.
const MOST_SHORTER: f64 = 0.3;
/// The reduction of a step that failed, or whose difference is meaningless.
const FAILED: f64 = 0.5;
/// The smallest reduction of the step.
const BELOW: f64 = 0.87;
/// A run is abandoned if its error, extrapolated to the end of the span, exceeds the accuracy by this factor.
const FORESEEN: f64 = 4.0;
/// The fractions of the span from which on linear growth of the error, and growth with its measured power, are
/// extrapolated.
const FORESEEN_FROM: [f64; 2] = [0.1, 0.4];
/// The power of time with which errors are assumed to grow if it was not measured.
const GROWTH: f64 = 1.5;
/// The largest measured power that is trusted: for the next step size, and after a good part of the span.
const MOST_GROWTH: [f64; 2] = [2.0, 4.0];
/// Large reductions of the step are raised by this additional power: with long steps errors decrease more slowly than
/// their order says.
const EXTRAPOLATED: f64 = 0.1;
/// The largest number of attempts, including those abandoned early; so many halvings leave no step.
const MOST_STARTS: usize = 40;
/// The number of times that shorter steps have not reduced the difference, after which the search ends.
const MOST_FLOORS: u32 = 3;

/// The element for steps solved by Newton's method. The cost of a step grows faster than its number of points, so that
/// fewer points are best than with fixed-point iteration. On the mechanisms of `tests/constraints/small_steps.rs`
/// these, or those with one node less, are fastest in most cases.
pub(super) fn element_for(accuracy: f64) -> Element {
    let nodes = match accuracy {
        a if a > 3e-5 => 4,
        a if a > 3e-8 => 5,
        a if a > 3e-11 => 6,
        _ => 8,
    };
    Element::mixed(nodes)
}

/// The reason why a run was abandoned, with the factor of the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    Shorter(f64),
    Longer(f64),
}

/// Judges two runs while they are made.
struct PairCriterion {
    accuracy: f64,
    order: f64,
    /// The largest increase of the step.
    most_longer: f64,
    /// Whether the run is completed in any case.
    is_last: bool,
    /// The largest magnitude of each kind over all runs.
    sizes: Vec<f64>,
    error: f64,
    /// The completed fraction of the span.
    done: f64,
    /// The completed fraction and the error, at every node so far.
    passed: Vec<(f64, f64)>,
}

impl PairCriterion {
    /// Returns a verdict if the error is or will be too large, or unnecessarily small.
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
        // Quadratic growth is assumed, since the motion may be slow at the start.
        let end = larger(error, f64::EPSILON) / (done * done);
        let longer = (self.accuracy / end).powf(1.0 / self.order) / AIM;
        let longer = longer.min(self.most_longer);
        let is_early = (NOT_EARLIER..=EARLY).contains(&done);
        (is_early && 1.0 / longer < WORTH * (1.0 - done)).then_some(Verdict::Longer(longer))
    }

    /// The factor by which steps must be shorter.
    fn shorter(&self) -> f64 {
        if !(self.error <= RESOLVED) {
            return FAILED;
        }
        let factor = (self.accuracy / self.foreseen(MOST_GROWTH[0])).powf(1.0 / self.order);
        (factor.powf(1.0 + EXTRAPOLATED) / AIM).clamp(MOST_SHORTER, BELOW)
    }

    /// Extrapolates the error to the end of the span, with the power of time by which it has grown; the power is
    /// limited to between 1 and `most`.
    fn foreseen(&self, most: f64) -> f64 {
        let Self { error, done, .. } = *self;
        let half = self.passed.partition_point(|(then, _)| *then < 0.5 * done);
        let Some(&(then, before)) = self.passed.get(half).filter(|(then, _)| *then < done) else {
            return error * done.powf(-GROWTH);
        };
        let power = (error / before).ln() / (done / then).ln();
        // If the error was zero or NaN.
        let power = if power.is_finite() {
            power.clamp(1.0, most)
        } else {
            GROWTH
        };
        error * done.powf(-power)
    }
}

/// Makes runs in pairs until one meets the accuracy.
///
/// # Errors
/// A failure that does not depend on the step size.
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
    let mut criterion = PairCriterion {
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
    // The extrapolated error of the previous run, which had longer steps.
    let mut before: Option<f64> = None;
    let (mut floors, mut tightened) = (0, 1.0);
    let mut runs = 0;
    for _ in 0..MOST_STARTS {
        if length / way.step > most_steps {
            let step = way.step;
            return Ok(Some(Climbed::TooMany { attempts, step }));
        }
        // A run that was abandoned early does not count.
        runs += usize::from(criterion.done >= NOT_EARLIER);
        criterion.is_last = runs + 1 >= MOST_RUNS || floors == MOST_FLOORS;
        // At most the geometric mean with the shortest step that was too long.
        criterion.most_longer =
            (MOST_LONGER.min(longest / way.step)).min((too_long / way.step).sqrt());
        (criterion.error, criterion.done) = (0.0, 0.0);
        criterion.passed.clear();
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
            verdict = criterion.look(done, beside);
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
        told.error_estimate = Some(criterion.error);
        let [first, second] = &ran.traces;
        if ran.is_complete && verdict.is_none() {
            let seen = difference(first, second);
            let error = largest(&seen);
            told.error_estimate = Some(error);
            attempts.push(told);
            let is_enough = error <= criterion.accuracy;
            errors = Some((ran.times, seen, error <= asked.accuracy / SAFE));
            if is_enough || criterion.is_last {
                break;
            }
            verdict = Some(Verdict::Shorter(criterion.shorter()));
        } else {
            attempts.push(told);
        }
        match verdict {
            Some(Verdict::Longer(factor)) => way.step = (factor * taken).min(longest),
            Some(Verdict::Shorter(factor)) => {
                let foreseen = criterion.foreseen(MOST_GROWTH[0]);
                if before.is_some_and(|before| foreseen > 0.5 * before)
                    && criterion.error < ROUNDINGS
                {
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
