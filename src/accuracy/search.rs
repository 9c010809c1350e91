//! The search for a step size: a probe at the start, then runs over the whole span, each compared with the previous
//! one.

mod cuts;
mod ladder;
mod paired;
mod probe;
mod runs;

use super::estimated::Picked;
use super::trace::difference;
use crate::error::RunErrorKind;
use cuts::{again, cuts};
use ladder::{Ladder, Verdict};
use probe::probe;
use runs::{
    AIM, COARSER, Climbed, FIRST, LEFT, LONGER, MAX_FACTOR, MAX_RUNS, MAX_STEPS, MIN_FACTOR,
    Noting, TIGHTEST, largest,
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
    found.map_err(|error| noting.explained(error))
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
    let mut failure = None;
    while ladder.attempts.len() < MAX_RUNS {
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
                failure = Some(failed.kind);
                settings.step *= 0.6;
            }
        }
    }
    let Some((errors, is_met)) = ladder.errors else {
        return Err(failure.unwrap_or(RunErrorKind::Step { step }));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::trace::Trace;
    use tfe_runtime::StepError;

    /// Runs with errors by a known law.
    struct Law<F> {
        error: F,
        contracts: bool,
        last: f64,
    }

    impl<F: Fn(&RunSettings<'_>, f64) -> f64> Runner for Law<F> {
        fn run(&mut self, settings: &RunSettings<'_>) -> Result<Ran, Failed> {
            let mut trace = Trace::new(1, 0);
            let step = settings.taken();
            for t in &settings.cuts[1..] {
                let off = (self.error)(settings, step) * (t - settings.cuts[0]) / 10.0;
                trace.pass(&[1.0 + off, 1.0], 0, true);
                if settings.keeps {
                    self.last = off;
                }
            }
            Ok(Ran {
                trace,
                contracts: self.contracts,
            })
        }

        fn run_pair(
            &mut self,
            settings: &RunSettings<'_>,
            better: &RunSettings<'_>,
            observer: &mut PairObserver<'_>,
        ) -> Result<PairRun, Failed> {
            let mut traces = [Trace::new(1, 0), Trace::new(1, 0)];
            let step = settings.taken();
            let (start, steps) = (settings.cuts[0], (10.0 / step).round() as u32);
            let mut times = Vec::new();
            for k in 1..=steps {
                let done = f64::from(k) / f64::from(steps);
                let off = [settings, better].map(|settings| done * (self.error)(settings, step));
                for (trace, off) in traces.iter_mut().zip(off) {
                    trace.pass(&[1.0 + off, 1.0], 0, true);
                }
                self.last = off[0];
                times.push(start + 10.0 * done);
                let goes_on = observer(&PairComparison {
                    time: start + 10.0 * done,
                    differences: &[(off[1] - off[0]).abs(), 0.0],
                    sizes: &[1.0, 1.0],
                });
                if goes_on.is_break() {
                    return Ok(PairRun {
                        traces,
                        times,
                        is_complete: false,
                    });
                }
            }
            Ok(PairRun {
                traces,
                times,
                is_complete: true,
            })
        }
    }

    /// The result of a search over ten units of time, with runs whose errors `error` gives for an element, a step and a
    /// tolerance.
    fn found(
        accuracy: f64,
        contracts: bool,
        error: impl Fn(&RunSettings<'_>, f64) -> f64,
    ) -> Result<(Found, f64), RunErrorKind> {
        found_in(false, accuracy, contracts, error)
    }

    fn found_in(
        in_pairs: bool,
        accuracy: f64,
        contracts: bool,
        error: impl Fn(&RunSettings<'_>, f64) -> f64,
    ) -> Result<(Found, f64), RunErrorKind> {
        let asked = Asked {
            accuracy,
            span: 0.0..10.0,
            breaks: vec![3.0],
            element: None,
            longest: None,
            may_iterate: true,
            solve: Solve::Auto,
            graded: None,
            in_pairs,
        };
        let mut law = Law {
            error,
            contracts,
            last: 0.0,
        };
        let found = search(&asked, &mut law, None)?;
        Ok((found, law.last))
    }

    /// Errors h^p: the estimate is right, and the step is not shorter than the safety factors require.
    #[test]
    fn finds_the_step_of_a_power_law() {
        for accuracy in [1e-2, 1e-4, 1e-6, 1e-9, 1e-12] {
            let law =
                |settings: &RunSettings<'_>, step: f64| step.powi(settings.element.order() as i32);
            let (found, error) = found(accuracy, true, law).expect("runs");
            assert!(found.is_met && error <= accuracy, "{accuracy}: {error}");
            let estimate = found.picked.error_estimate;
            // The error of the element of the next order is smaller by h².
            assert!(
                (estimate - error).abs() < 0.5 * error + 1e-15,
                "{estimate}, {error}"
            );
            let order = found.picked.element.order() as f64;
            let longest = accuracy.powf(1.0 / order);
            assert!(found.picked.step > longest / 2.0, "{}", found.picked.step);
            assert_eq!(found.times.last(), Some(&10.0));
            assert!(found.times.contains(&3.0));
        }
    }

    /// The same for runs in pairs, from first steps that are far too long or too short.
    #[test]
    fn pairs_find_the_step_of_a_power_law() {
        for accuracy in [1e-2, 1e-4, 1e-6, 1e-9, 1e-12] {
            for scale in [0.3, 1.0, 10.0] {
                let law = |settings: &RunSettings<'_>, step: f64| {
                    (step / scale).powi(settings.element.order() as i32)
                };
                let (found, error) = found_in(true, accuracy, false, law).expect("runs");
                assert!(found.is_met && error <= accuracy, "{accuracy}: {error}");
                let estimate = found.picked.error_estimate;
                assert!(
                    (estimate - error).abs() < 0.5 * error + 1e-15,
                    "{estimate}, {error}"
                );
                let order = found.picked.element.order() as f64;
                let longest = scale * accuracy.powf(1.0 / order);
                assert!(
                    found.picked.step > longest.min(1.25) / 1.8,
                    "{accuracy} {scale}: {} {longest}",
                    found.picked.step
                );
                assert!(
                    found.picked.attempts.len() <= 6,
                    "{:?}",
                    found.picked.attempts
                );
                assert_eq!(found.times.last(), Some(&10.0));
            }
        }
    }

    /// An error that does not decrease with the step is refused, after a run over the whole span; one that decreases
    /// with the tolerance is met.
    #[test]
    fn pairs_know_what_cannot_be_had() {
        let noise = |settings: &RunSettings<'_>, step: f64| {
            (1e5 * step + settings.element.nodes() as f64).sin()
        };
        let (refused, _) = found_in(true, 1e-12, false, |settings, step| {
            1e-10 * noise(settings, step)
        })
        .expect("runs");
        assert!(!refused.is_met && refused.picked.error_estimate >= 1e-12);
        assert!(refused.picked.attempts.len() < 10);
        let by_tolerance = |settings: &RunSettings<'_>, step: f64| {
            1e4 * settings.tolerance * noise(settings, step)
        };
        let (found, error) = found_in(true, 1e-6, false, by_tolerance).expect("runs");
        assert!(found.is_met && error.abs() <= 1e-6, "{error}");
        let outcome = found_in(true, 1e-6, false, |_, _| f64::NAN);
        assert!(outcome.is_err());
    }

    /// Errors decrease as h² only, whatever the order of the element, with Newton's method: the order is measured, and
    /// the accuracy met.
    #[test]
    fn measures_an_order_that_is_reduced() {
        let (found, error) = found(1e-6, false, |_, step| 1e-3 * step * step).expect("runs");
        assert!(found.is_met && error <= 1e-6, "{error}");
        assert!(found.picked.attempts.len() > 2);
    }

    /// Rounding errors do not decrease, and iteration errors decrease only with the tolerance.
    #[test]
    fn knows_what_cannot_be_had_and_tightens_what_can() {
        let noise = |step: f64| (1e5 * step).sin();
        let (refused, _) = found(1e-12, true, |_, step| 1e-10 * noise(step)).expect("runs");
        assert!(!refused.is_met && refused.picked.error_estimate >= 1e-12);
        let by_tolerance =
            |settings: &RunSettings<'_>, step: f64| 1e4 * settings.tolerance * noise(step);
        let (found, error) = found(1e-6, true, by_tolerance).expect("runs");
        assert!(found.is_met && error.abs() <= 1e-6, "{error}");
    }

    /// Runs that fail with every step, and with another error where the time does not resolve the step.
    struct Failing;

    impl Runner for Failing {
        fn run(&mut self, settings: &RunSettings<'_>) -> Result<Ran, Failed> {
            let (time, step) = (1.0, settings.step);
            Err(Failed::from(if step < 1e-14 {
                let least = 1e-14;
                RunErrorKind::StepUnresolved { time, step, least }
            } else {
                RunErrorKind::Solve {
                    element: 0,
                    time,
                    step,
                    source: StepError::NonFinite,
                }
            }))
        }

        fn run_pair(
            &mut self,
            settings: &RunSettings<'_>,
            _: &RunSettings<'_>,
            _: &mut PairObserver<'_>,
        ) -> Result<PairRun, Failed> {
            Err(self.run(settings).expect_err("all runs fail"))
        }
    }

    /// The error returned is that of the steps which the time resolves.
    #[test]
    fn what_fails_with_every_step_says_why() {
        let asked = Asked {
            accuracy: 1e-6,
            span: 1.0..11.0,
            breaks: Vec::new(),
            element: None,
            longest: None,
            may_iterate: true,
            solve: Solve::Auto,
            graded: None,
            in_pairs: false,
        };
        let kind = search(&asked, &mut Failing, None).expect_err("all runs fail");
        assert!(
            matches!(&kind, RunErrorKind::Solve { source, .. } if *source == StepError::NonFinite),
            "{kind}"
        );
    }

    #[test]
    fn what_is_never_finite_is_refused() {
        let outcome = found(1e-6, true, |_, _| f64::NAN);
        assert!(outcome.is_err() || outcome.is_ok_and(|(found, _)| !found.is_met));
        let outcome = found(
            1e-6,
            true,
            |settings, _| if settings.keeps { f64::NAN } else { 0.0 },
        );
        assert!(outcome.is_ok_and(|(found, _)| !found.is_met));
    }
}
