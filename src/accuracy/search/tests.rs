//! Tests of the search, by runs whose errors follow a known law.

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
        outputs: Vec::new(),
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
    let by_tolerance =
        |settings: &RunSettings<'_>, step: f64| 1e4 * settings.tolerance * noise(settings, step);
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
        outputs: Vec::new(),
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
