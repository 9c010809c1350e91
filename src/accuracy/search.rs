//! The search for a step size: a probe at the start, then runs over the whole span, each compared with the previous
//! one.

mod cuts;
mod ladder;
mod paired;
mod probe;
mod runs;
#[cfg(test)]
mod tests;

use super::estimated::Picked;
use super::trace::difference;
use crate::error::RunErrorKind;
use cuts::{again, cuts};
use ladder::{Ladder, Verdict};
use probe::probe;
use runs::{
    AIM, COARSER, Climbed, FIRST, LEFT, LONGER, MAX_FACTOR, MAX_FAILURES, MAX_RUNS, MAX_STEPS,
    MIN_FACTOR, Noting, TIGHTEST, largest,
};
pub(crate) use runs::{
    Asked, Failed, Found, Graded, PairComparison, PairObserver, PairRun, Pilot, Ran, RunSettings,
    Runner, next,
};
use tfe_runtime::{Element, Solve, Statistics};

/// For accuracies above this, a motion takes fewer operations with four quadrature points than with eight, and vice
/// versa. Measured on eight examples, from a pendulum to planets with eighteen coordinates (`docs/theory.md` §14.3).
const FEW_POINTS: f64 = 1e-5;
/// The tolerance of iterations in the verifying run, relative to that of the run to be verified.
const VERIFIED: f64 = 1e-3;
/// Up to this number of equal steps, a pilot run would cost more than it saves.
const MANY: f64 = 200.0;
/// Newton's method is used if its steps can be longer than those for which the fixed-point iteration converges by this
/// factor.
const STIFF: f64 = 3.0;

/// Makes runs until the estimated error is within the accuracy: with equal steps, or, if those would be many and there
/// is a pilot run, with graded steps.
///
/// # Errors
/// A failure that does not depend on the step size.
pub(crate) fn search(
    asked: &Asked,
    run: &mut dyn Runner,
    pilot: Option<&mut Pilot<'_>>,
) -> Result<Found, RunErrorKind> {
    let mut noting = Noting::new(run);
    let found = searched(asked, &mut noting, pilot);
    noting.concluded(found, &asked.outputs)
}

fn searched(
    asked: &Asked,
    run: &mut dyn Runner,
    pilot: Option<&mut Pilot<'_>>,
) -> Result<Found, RunErrorKind> {
    if let Some(graded) = &asked.graded {
        return run_down(asked, graded_settings(asked, graded), run);
    }
    let length = (asked.span.end - asked.span.start).abs();
    let mut before = Vec::new();
    let climbed = if asked.in_pairs {
        let most_steps = if pilot.is_some() { MANY } else { MAX_STEPS };
        paired::climb(asked, newton_settings(asked), run, most_steps)?
    } else {
        None
    };
    let mut even = match climbed {
        Some(Climbed::Found(found)) => return Ok(*found),
        Some(Climbed::TooMany { attempts, step }) => {
            before = attempts;
            Ok((newton_settings(asked), step))
        }
        None => even_settings(asked, run),
    };
    let Some(pilot) = pilot else {
        return run_down(asked, even?, run);
    };
    if let Ok((settings, step)) = &even
        && length / step <= MANY
    {
        match climb(asked, (settings.clone(), *step), run, MANY)? {
            Climbed::Found(found) => return Ok(*found),
            Climbed::TooMany { attempts, step } => {
                before = attempts;
                even = even.map(|(settings, _)| (settings, step));
            }
        }
    }
    let first = even.as_ref().map_or(1e-3 * length, |(_, step)| *step);
    let graded = pilot(first);
    let settings = match &graded {
        Some(graded) => graded_settings(asked, graded),
        None => even?,
    };
    let mut found = run_down(asked, settings, run)?;
    before.append(&mut found.picked.attempts);
    found.picked.attempts = before;
    Ok(found)
}

/// Makes runs with decreasing steps; fails if these become too many.
fn run_down(
    asked: &Asked,
    settings: (RunSettings<'_>, f64),
    run: &mut dyn Runner,
) -> Result<Found, RunErrorKind> {
    match climb(asked, settings, run, MAX_STEPS)? {
        Climbed::Found(found) => Ok(*found),
        Climbed::TooMany { step, .. } => {
            let span = asked.span.end - asked.span.start;
            Err(RunErrorKind::TooManySteps { span, step })
        }
    }
}

/// The factor of a grading whose steps have the local error `local`, such that the sum of the errors meets the accuracy
/// (T-103). It is limited so that the first run takes no longer steps than the pilot run: it could step over what the
/// pilot run has not seen.
pub(crate) fn factor_for(accuracy: f64, element: Element, local: f64, steps: f64) -> f64 {
    let factor = (accuracy / (local * steps)).powf(1.0 / element.order() as f64) / LONGER;
    factor.min(1.0 / COARSER)
}

/// The cheapest of the elements considered, for steps solved by fixed-point iteration.
pub(crate) fn element_for(accuracy: f64) -> Element {
    if accuracy > FEW_POINTS {
        Element::mixed(5)
    } else {
        Element::mixed(9)
    }
}

/// The cheapest element with numerical damping, for steps solved by Newton's method, whose cost grows with the third
/// power of the number of points.
pub(crate) fn damping_element_for(accuracy: f64) -> Element {
    if accuracy > FEW_POINTS {
        Element::radau(5)
    } else {
        Element::radau(7)
    }
}

/// A trial with equal steps, solved by Newton's method, with the longest step allowed.
fn newton_settings<'a>(asked: &Asked) -> RunSettings<'a> {
    let length = (asked.span.end - asked.span.start).abs();
    RunSettings {
        element: (asked.element).unwrap_or_else(|| paired::element_for(asked.accuracy)),
        tolerance: 1e-3 * asked.accuracy,
        by_iteration: false,
        step: asked.longest.map_or(length, |step| step.abs().min(length)),
        cuts: &[],
        grading: None,
        keeps: false,
    }
}

/// A trial with a grading, and its factor.
fn graded_settings<'a>(asked: &'a Asked, graded: &'a Graded) -> (RunSettings<'a>, f64) {
    let mut settings = RunSettings {
        element: graded.element,
        tolerance: 1e-3 * asked.accuracy,
        by_iteration: false,
        step: graded.factor,
        cuts: &[],
        grading: Some(&graded.grading),
        keeps: false,
    };
    let longest = settings.lengths(asked).1;
    settings.step = longest;
    (settings, graded.factor.min(longest))
}

/// A trial with equal steps, and the step size that a probe at the start suggests.
fn even_settings<'a>(
    asked: &'a Asked,
    run: &mut dyn Runner,
) -> Result<(RunSettings<'a>, f64), RunErrorKind> {
    let element = asked.element.unwrap_or_else(|| element_for(asked.accuracy));
    let length = (asked.span.end - asked.span.start).abs();
    let longest = asked.longest.map_or(length, |step| step.abs().min(length));
    let mut settings = RunSettings {
        element,
        tolerance: 1e-3 * asked.accuracy,
        by_iteration: asked.may_iterate,
        step: longest,
        cuts: &[],
        grading: None,
        keeps: false,
    };
    settings.step = longest.min(length / FIRST);
    let mut step = probe(asked, &mut settings, longest, run);
    if asked.may_iterate && step.as_ref().map_or(true, |(_, factor)| *factor > STIFF) {
        // The convergence of the fixed-point iteration, not the accuracy, limits the step.
        let mut implicit = RunSettings {
            by_iteration: false,
            step: longest,
            ..settings.clone()
        };
        let by_newton = probe(asked, &mut implicit, longest, run);
        let longer = match (&step, &by_newton) {
            (Ok((iterated, _)), Ok((solved, _))) => *solved > STIFF * iterated,
            (Err(_), Ok(_)) => true,
            _ => false,
        };
        if longer {
            (step, settings) = (by_newton, implicit);
        }
    }
    let (step, _) = step?;
    // With much longer steps the fixed-point iteration may not converge.
    settings.step = if settings.by_iteration {
        (settings.step * LONGER).max(step)
    } else {
        longest
    };
    Ok((settings, step))
}

/// Makes runs with decreasing steps, the first one of about `step`.
fn climb(
    asked: &Asked,
    (settings, step): (RunSettings<'_>, f64),
    run: &mut dyn Runner,
    most_steps: f64,
) -> Result<Climbed, RunErrorKind> {
    let cuts = cuts(asked, settings.grading, step);
    let mut settings = RunSettings {
        cuts: &cuts,
        ..settings
    };
    let element = settings.element;
    let (length, longest) = settings.lengths(asked);
    settings.tolerance = asked.tolerance(length / step);
    settings.step = (COARSER * step).min(longest).min(settings.step);
    let mut ladder = Ladder::new(element, asked.accuracy, settings.grading.is_some());
    let (mut failures, mut failure) = (0, None);
    while ladder.attempts.len() < MAX_RUNS + failures && failures < MAX_FAILURES {
        if length / settings.step > most_steps {
            let (attempts, step) = (ladder.attempts, settings.step);
            return Ok(Climbed::TooMany { attempts, step });
        }
        settings.keeps = ladder.last.is_some();
        let taken = settings.taken();
        let mut here = settings.clone();
        if !settings.keeps {
            // The error of the first run is much larger than that of the second; and amplified iteration errors become
            // visible in the comparison.
            here.tolerance *= (COARSER.powf(element.order() as f64) / 3.0).max(1.0);
        }
        match run.run(&here) {
            Ok(ran) => match ladder.climb(taken, ran) {
                Verdict::Enough => match verify(&settings, taken, &mut ladder, run) {
                    Some(wanted) => {
                        settings.step = wanted;
                        settings.tolerance = (0.2 * settings.tolerance).max(TIGHTEST);
                    }
                    None => break,
                },
                Verdict::Shorter(wanted) => {
                    settings.step = wanted;
                    if settings.keeps {
                        // Amplified iteration errors become visible in the comparison, as above.
                        settings.tolerance = (0.2 * settings.tolerance).max(TIGHTEST);
                    }
                }
                Verdict::Floor if settings.tolerance > TIGHTEST => {
                    settings.tolerance *= 1e-2;
                    settings.step = taken * MAX_FACTOR;
                    ladder.differences = None;
                }
                Verdict::Floor => break,
            },
            Err(failed) if failed.is_final_after(failure.as_ref()) => return Err(failed.kind),
            Err(failed) => {
                ladder.fail(taken);
                (failures, failure) = (failures + 1, Some(failed.kind));
                settings.step *= 0.6;
            }
        }
    }
    let Some((errors, is_met)) = ladder.errors else {
        let span = asked.span.end - asked.span.start;
        return Err(failure.unwrap_or(RunErrorKind::TooManySteps { span, step }));
    };
    let mut attempts = ladder.attempts;
    let extremes = settings.measure(&mut attempts);
    Ok(Climbed::Found(Box::new(Found {
        is_met,
        picked: Picked {
            element,
            step: extremes.1,
            shortest: extremes.0,
            tolerance: settings.tolerance,
            solve: if settings.by_iteration {
                Solve::FixedPoint
            } else {
                asked.solve
            },
            accuracy: asked.accuracy,
            error_estimate: largest(&errors),
            attempts,
            // The work is counted by the runner.
            work: Statistics::NONE,
        },
        times: cuts[1..].to_vec(),
        errors,
    })))
}

/// Verifies the last run by one of the next higher order over the same steps, with a much smaller tolerance. The
/// difference estimates its error independently of the runs with other steps. Returns a shorter step if the error is
/// too large. Without a converging fixed-point iteration (stiff motion), the orders of both elements may be reduced
/// alike; the estimate is then never decreased.
fn verify(
    settings: &RunSettings<'_>,
    taken: f64,
    ladder: &mut Ladder,
    run: &mut dyn Runner,
) -> Option<f64> {
    let (_, last) = ladder.last.as_ref()?;
    let (errors, is_met) = ladder.errors.as_mut()?;
    if !*is_met {
        return None;
    }
    let better = RunSettings {
        element: next(settings.element)?,
        tolerance: (VERIFIED * settings.tolerance).max(TIGHTEST),
        step: again(taken),
        keeps: false,
        ..settings.clone()
    };
    // If this run fails, the estimate stays.
    let ran = run.run(&better).ok()?;
    let seen = difference(&last.trace, &ran.trace);
    // The comparison contains the iteration error, so the allowance for it is removed.
    let left = LEFT * ladder.accuracy;
    for (error, seen) in errors.iter_mut().flatten().zip(seen.iter().flatten()) {
        let told = if last.contracts { 0.0 } else { *error - left };
        *error = told.max(*seen);
    }
    let error = largest(errors);
    if let Some(attempt) = ladder.attempts.last_mut() {
        attempt.error_estimate = Some(error);
    }
    if error <= ladder.accuracy {
        return None;
    }
    *is_met = false;
    ladder.differences = None;
    let factor = (ladder.accuracy / error).powf(1.0 / ladder.order) / AIM;
    Some(taken * factor.clamp(MIN_FACTOR, MAX_FACTOR))
}
