//! The search for a step: a probe at the start, then runs over the whole span, each compared with the one before.

use super::estimated::{Attempt, Picked};
use super::trace::{Trace, difference};
use crate::error::RunErrorKind;
use std::ops::Range;
use tfe_runtime::Element;

/// What is asked of a run.
#[derive(Clone, Debug)]
pub(crate) struct Asked {
    pub(crate) accuracy: f64,
    pub(crate) span: Range<f64>,
    /// Times at which elements have to end.
    pub(crate) breaks: Vec<f64>,
    /// The element, where it is not to be picked.
    pub(crate) element: Option<Element>,
    /// The longest step allowed.
    pub(crate) longest: Option<f64>,
    /// Whether there is a fixed-point iteration.
    pub(crate) may_iterate: bool,
}

/// One way to run.
#[derive(Clone, Debug)]
pub(crate) struct Way<'a> {
    pub(crate) element: Element,
    pub(crate) tolerance: f64,
    /// Whether a step that does not contract counts as one that fails.
    pub(crate) by_iteration: bool,
    /// The longest step, positive.
    pub(crate) step: f64,
    /// Start, times of comparison, end; between two of them steps are equal.
    pub(crate) cuts: &'a [f64],
    /// Whether it may be the motion that is asked for.
    pub(crate) keeps: bool,
}

/// What has come of a run.
#[derive(Clone, Debug)]
pub(crate) struct Ran {
    pub(crate) trace: Trace,
    /// Whether a fixed-point iteration contracted in every step. Then steps are short beside all times of the model, and errors fall with the order of the element.
    pub(crate) contracts: bool,
}

/// What makes a run.
pub(crate) type Runner<'r> = dyn FnMut(&Way<'_>) -> Result<Ran, RunErrorKind> + 'r;

/// What a search has found.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) picked: Picked,
    pub(crate) times: Vec<f64>,
    /// Of each kind at each time.
    pub(crate) errors: Vec<Vec<f64>>,
    /// Whether the accuracy is met.
    pub(crate) is_met: bool,
}

/// Above it a motion of these elements takes fewer operations with four points than with eight, below it the other way round; so it was on eight scenes
/// from a pendulum to eighteen coordinates of planets (`docs/theory.md` §14.3).
const FEW_POINTS: f64 = 1e-5;
/// What errors of the iteration may be of what is asked, all steps together: what they leave has the same sign in step after step.
const ITERATION: f64 = 0.03;
/// Iterations do not end earlier with less.
const TIGHTEST: f64 = 1e-17;
/// Above it roundings do not show, and what they take needs not be carried along.
const ROUGH: f64 = 0.99e-11;
/// A first step longer than the second one by this factor costs two thirds of it.
const COARSER: f64 = 1.5;
/// A comparison with a run of an error above this says nothing about one with shorter steps.
const RESOLVED: f64 = 0.1;
/// Steps have become a hundred times shorter then, and errors of each step less than a rounding: it is the motion that lets them grow.
const MOST_UNRESOLVED: u32 = 5;
/// Runs over the whole span.
const MOST_RUNS: usize = 14;
/// Steps between two times of comparison: so many that steps can be chosen finely.
const STEPS_BETWEEN: f64 = 12.0;
const MOST_TIMES: f64 = 64.0;
/// How much shorter the next step may be, and has to be.
const LEAST_FACTOR: f64 = 0.4;
const MOST_FACTOR: f64 = 0.87;
/// However much shorter the second step, errors are not believed to fall by more.
const MOST_GAIN: f64 = 700.0;
/// The same where iterations of both runs end nearly alike: what they leave may have grown, and does not fall at all.
const MOST_GAIN_MEASURED: f64 = 30.0;
/// Errors do not fall smoothly where steps meet a pericentre now here, now there: by the estimate, steps longer by this factor have to be enough too.
const LONGER: f64 = 1.2;
/// The same where it was measured how errors fall with the step.
const LONGER_MEASURED: f64 = 1.1;
/// What is added to estimates for what iterations leave, which two runs have in common: relative to what is asked.
const LEFT: f64 = 0.1;
/// The next step aims a little beyond that.
const AIM: f64 = 1.13;
/// By what factor a step that contracts is shorter than one that is accurate where Newton's method pays.
const STIFF: f64 = 3.0;
/// Steps that differ by less tell nothing.
const SAME: f64 = 1.01;
/// Differences below it that do not fall are of roundings.
const ROUNDINGS: f64 = 1e-6;

/// Runs until the estimated error is at or below what is asked.
///
/// # Errors
/// What stops runs of every step.
pub(crate) fn search(asked: &Asked, run: &mut Runner<'_>) -> Result<Found, RunErrorKind> {
    let element = asked.element.unwrap_or(if asked.accuracy > FEW_POINTS {
        Element::mixed(5)
    } else {
        Element::mixed(9)
    });
    let length = (asked.span.end - asked.span.start).abs();
    let longest = asked.longest.map_or(length, |step| step.abs().min(length));
    let mut way = Way {
        element,
        tolerance: 1e-3 * asked.accuracy,
        by_iteration: asked.may_iterate,
        step: longest,
        cuts: &[],
        keeps: false,
    };
    let mut step = probe(asked, &mut way, run);
    if asked.may_iterate && step.as_ref().map_or(true, |(_, factor)| *factor > STIFF) {
        // Steps that contract are far shorter than they need be: it is not accuracy that limits them.
        let mut implicit = Way {
            by_iteration: false,
            step: longest,
            ..way.clone()
        };
        let by_newton = probe(asked, &mut implicit, run);
        let longer = match (&step, &by_newton) {
            (Ok((iterated, _)), Ok((solved, _))) => *solved > STIFF * iterated,
            (Err(_), Ok(_)) => true,
            _ => false,
        };
        if longer {
            (step, way) = (by_newton, implicit);
        }
    }
    let (step, _) = step?;
    let cuts = cuts(asked, step);
    way.cuts = &cuts;
    way.tolerance = ITERATION * asked.accuracy / (length / step).max(1.0);
    if asked.accuracy > ROUGH {
        way.tolerance = way.tolerance.max(1.1e-3 * ROUGH);
    }
    way.step = (COARSER * step).min(longest);
    let mut ladder = Ladder::new(element.order(), asked.accuracy);
    let mut failure = None;
    while ladder.attempts.len() < MOST_RUNS {
        way.keeps = ladder.last.is_some();
        let taken = even_steps(&cuts, way.step);
        let mut here = way.clone();
        if !way.keeps {
            // Its error is so much larger than that of the run that it is compared with; and errors of iterations that grow with the motion show in the comparison.
            here.tolerance *= (COARSER.powf(element.order() as f64) / 3.0).max(1.0);
        }
        match run(&here) {
            Ok(ran) => match ladder.climb(taken, ran) {
                Verdict::Enough => break,
                Verdict::Shorter(wanted) => {
                    way.step = wanted.min(step);
                    if way.keeps {
                        // For the same reason.
                        way.tolerance = (0.1 * way.tolerance).max(TIGHTEST);
                    }
                }
                Verdict::Floor if way.tolerance > TIGHTEST => {
                    way.tolerance *= 1e-2;
                    way.step = taken * MOST_FACTOR;
                    ladder.apart = None;
                }
                Verdict::Floor => break,
            },
            Err(kind) => {
                ladder.fail(taken);
                failure = Some(kind);
                way.step *= 0.6;
            }
        }
    }
    let Some((errors, is_met)) = ladder.errors else {
        return Err(failure.unwrap_or(RunErrorKind::Step { step }));
    };
    Ok(Found {
        is_met,
        picked: Picked {
            element,
            step: ladder.attempts.last().map_or(step, |attempt| attempt.step),
            tolerance: way.tolerance,
            accuracy: asked.accuracy,
            error_estimate: largest(&errors),
            attempts: ladder.attempts,
        },
        times: cuts[1..].to_vec(),
        errors,
    })
}

/// Runs with shorter and shorter steps.
struct Ladder {
    order: f64,
    accuracy: f64,
    attempts: Vec<Attempt>,
    /// The step and what came of it.
    last: Option<(f64, Ran)>,
    /// How far the last two runs were apart.
    apart: Option<f64>,
    /// Of the last run, and whether that is enough.
    errors: Option<(Vec<Vec<f64>>, bool)>,
    /// Comparisons in a row that have told nothing.
    unresolved: u32,
}

enum Verdict {
    Enough,
    /// The next step.
    Shorter(f64),
    /// Shorter steps do not help: errors of iterations or of roundings have grown.
    Floor,
}

impl Ladder {
    fn new(order: usize, accuracy: f64) -> Self {
        Self {
            order: order as f64,
            accuracy,
            attempts: Vec::new(),
            last: None,
            apart: None,
            errors: None,
            unresolved: 0,
        }
    }

    fn fail(&mut self, step: f64) {
        self.attempts.push(Attempt {
            step,
            error_estimate: None,
        });
        (self.last, self.apart) = (None, None);
    }

    /// Compares a run with the one before.
    fn climb(&mut self, step: f64, ran: Ran) -> Verdict {
        let mut attempt = Attempt {
            step,
            error_estimate: None,
        };
        let Some((longer, before)) = self.last.replace((step, ran)) else {
            self.attempts.push(attempt);
            return Verdict::Shorter(step / COARSER);
        };
        let Some((_, ran)) = &self.last else {
            return Verdict::Enough;
        };
        let mut errors = difference(&before.trace, &ran.trace);
        let apart = largest(&errors);
        let contracts = before.contracts && ran.contracts;
        // What the run before was off by is known now, and with what the one before that was off by, the power of the step.
        let ratio = longer / step;
        let power = match (self.apart, self.attempts.iter().rev().nth(1)) {
            (Some(earlier), Some(first)) if earlier <= RESOLVED => {
                let power = (earlier / apart).ln() / (first.step / longer).ln();
                Some(power).filter(|power| power.is_finite())
            }
            _ => None,
        };
        if let Some(attempt) = self.attempts.last_mut() {
            attempt.error_estimate = Some(apart);
        }
        let at_floor = power.is_some_and(|power| power < 1.0) && apart < ROUNDINGS;
        let (longer, most_gain) = if power.is_some() {
            (LONGER_MEASURED, MOST_GAIN_MEASURED)
        } else {
            (LONGER, MOST_GAIN)
        };
        // A power that is not measured is that of the element only where errors are known to fall with it.
        let power = power.map(|power| power.clamp(1.0, self.order));
        let known = (power.is_some() || contracts) && ratio > SAME;
        let power = power.unwrap_or(self.order);
        let gain = if apart <= RESOLVED && ratio > SAME {
            (ratio.powf(power) - 1.0).min(most_gain)
        } else {
            1.0
        };
        let left = LEFT * self.accuracy;
        for error in errors.iter_mut().flatten() {
            *error = *error / gain + left;
        }
        let error = apart / gain;
        attempt.error_estimate = Some(error + left);
        self.attempts.push(attempt);
        self.apart = Some(apart);
        let is_met =
            known && apart <= RESOLVED && error * longer.powf(power) <= self.accuracy - left;
        self.errors = Some((errors, is_met));
        self.unresolved = if apart <= RESOLVED {
            0
        } else {
            self.unresolved + 1
        };
        if is_met || self.unresolved == MOST_UNRESOLVED {
            return Verdict::Enough;
        }
        if at_floor {
            return Verdict::Floor;
        }
        let factor = if apart <= RESOLVED {
            (self.accuracy / error).powf(1.0 / power) / AIM
        } else {
            0.0
        };
        Verdict::Shorter(step * factor.clamp(LEAST_FACTOR, MOST_FACTOR))
    }
}

/// A step that is near, and by what factor it should be longer than the longest one that could be made: one step at the start against two of half its length.
fn probe(
    asked: &Asked,
    way: &mut Way<'_>,
    run: &mut Runner<'_>,
) -> Result<(f64, f64), RunErrorKind> {
    /// Halvings of the span: 2⁻⁶⁰ of it is nothing.
    const MOST: u32 = 60;
    /// A difference that tells the order.
    const CLEAR: f64 = 1e-3;
    let Asked { accuracy, span, .. } = asked;
    let length = (span.end - span.start).abs();
    let direction = (span.end - span.start).signum();
    let order = way.element.order() as f64;
    let mut failure = None;
    for _ in 0..MOST {
        let h = way.step;
        let cuts = [span.start, span.start + direction * h];
        let mut over = |step: f64| {
            run(&Way {
                step,
                cuts: &cuts,
                ..way.clone()
            })
        };
        let pair = over(h).and_then(|whole| Ok((whole, over(h / 2.0)?)));
        match pair {
            Ok((whole, halves)) => {
                let apart = largest(&difference(&whole.trace, &halves.trace)).max(f64::EPSILON);
                if apart <= CLEAR {
                    // Steps whose local errors add up to what is asked, and drift as errors of a frequency do.
                    let steps = length / h;
                    let sum = apart * steps * (steps / 4.0).max(1.0);
                    let wanted = (accuracy / sum).powf(1.0 / order) / LONGER;
                    return Ok((h * wanted.clamp(1e-3, 1.5), wanted));
                }
                way.step /= if apart > 1.0 { 4.0 } else { 2.0 };
            }
            Err(kind) => {
                way.step /= 3.0;
                failure = Some(kind);
            }
        }
    }
    Err(failure.unwrap_or(RunErrorKind::Step { step: way.step }))
}

/// Start, times of comparison with breaks among them, end.
fn cuts(asked: &Asked, step: f64) -> Vec<f64> {
    let Range { start, end } = asked.span;
    let direction = (end - start).signum();
    let mut corners: Vec<f64> = asked.breaks.clone();
    corners.retain(|t| direction * start < direction * t && direction * t < direction * end);
    corners.push(end);
    corners.sort_by(|a, b| (direction * a).total_cmp(&(direction * b)));
    corners.dedup();
    let length = (end - start).abs();
    let times = (length / (STEPS_BETWEEN * step)).clamp(1.0, MOST_TIMES);
    let mut cuts = vec![start];
    let mut from = start;
    for to in corners {
        let parts = (times * (to - from).abs() / length).round().max(1.0);
        for k in 1..parts as usize {
            cuts.push(from + (to - from) * (k as f64 / parts));
        }
        cuts.push(to);
        from = to;
    }
    cuts
}

/// The longest step where all parts are cut into equal steps of at most `step`.
fn even_steps(cuts: &[f64], step: f64) -> f64 {
    let lengths = cuts.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    lengths.fold(0.0, |most: f64, length| {
        most.max(length / (length / step).ceil().max(1.0))
    })
}

fn largest(errors: &[Vec<f64>]) -> f64 {
    errors.iter().flatten().copied().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs that are off by what `error` says of element, step and tolerance, over ten units of time.
    fn found(
        accuracy: f64,
        contracts: bool,
        error: impl Fn(&Way<'_>, f64) -> f64,
    ) -> Result<(Found, f64), RunErrorKind> {
        let asked = Asked {
            accuracy,
            span: 0.0..10.0,
            breaks: vec![3.0],
            element: None,
            longest: None,
            may_iterate: true,
        };
        let mut last = 0.0;
        let found = search(&asked, &mut |way| {
            let mut trace = Trace::new(1, 0);
            let step = even_steps(way.cuts, way.step);
            for t in &way.cuts[1..] {
                last = error(way, step) * (t - way.cuts[0]) / 10.0;
                trace.pass(&[1.0 + last, 1.0], true);
            }
            Ok(Ran { trace, contracts })
        })?;
        Ok((found, last))
    }

    /// Errors h^p: the estimate is right, and the step no shorter than safety asks for.
    #[test]
    fn finds_the_step_of_a_power_law() {
        for accuracy in [1e-2, 1e-4, 1e-6, 1e-9, 1e-12] {
            let law = |way: &Way<'_>, step: f64| step.powi(way.element.order() as i32);
            let (found, error) = found(accuracy, true, law).expect("runs");
            assert!(found.is_met && error <= accuracy, "{accuracy}: {error}");
            let estimate = found.picked.error_estimate - LEFT * accuracy;
            // Not below the error; above it where a fall by more than `MOST_GAIN` is not believed.
            assert!(estimate > 0.95 * error, "{estimate}, {error}");
            let order = found.picked.element.order() as f64;
            let longest = accuracy.powf(1.0 / order);
            assert!(found.picked.step > longest / 2.0, "{}", found.picked.step);
            assert_eq!(found.times.last(), Some(&10.0));
            assert!(found.times.contains(&3.0));
        }
    }

    /// Errors that fall with h² alone, whatever the element promises, where Newton's method makes the steps: the power is measured, and the error met.
    #[test]
    fn measures_an_order_that_is_reduced() {
        let (found, error) = found(1e-6, false, |_, step| 1e-3 * step * step).expect("runs");
        assert!(found.is_met && error <= 1e-6, "{error}");
        assert!(found.picked.attempts.len() > 2);
    }

    /// What roundings leave does not fall, and what iterations leave falls with the tolerance alone.
    #[test]
    fn knows_what_cannot_be_had_and_tightens_what_can() {
        let noise = |step: f64| (1e5 * step).sin();
        let (refused, _) = found(1e-12, true, |_, step| 1e-10 * noise(step)).expect("runs");
        assert!(!refused.is_met && refused.picked.error_estimate >= 1e-12);
        let by_tolerance = |way: &Way<'_>, step: f64| 1e4 * way.tolerance * noise(step);
        let (found, error) = found(1e-6, true, by_tolerance).expect("runs");
        assert!(found.is_met && error.abs() <= 1e-6, "{error}");
    }

    #[test]
    fn what_is_never_finite_is_refused() {
        let outcome = found(1e-6, true, |_, _| f64::NAN);
        assert!(outcome.is_err() || outcome.is_ok_and(|(found, _)| !found.is_met));
        let outcome = found(1e-6, true, |way, _| if way.keeps { f64::NAN } else { 0.0 });
        assert!(outcome.is_ok_and(|(found, _)| !found.is_met));
    }
}
