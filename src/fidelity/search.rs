//! The runs of one rung: steps are halved until the error no longer decreases, then runs are repeated for timing.

use super::ladder::{Choice, Rung, RungPoint};
use super::rung::{Outputs, Runs, Seen};
use super::truth::Truth;
use crate::error::RunErrorKind;
use crate::work_precision::grid::Grid;
use crate::work_precision::measure::{Best, Discretisation};
use std::time::Duration;
use tfe_runtime::Element;
use tfe_runtime::step::Control;

/// All runs of a rung.
pub(super) struct Search<'a> {
    rung: &'a dyn Runs,
    outputs: Outputs<'a>,
    truth: &'a Truth,
    trials: Vec<Trial<'a>>,
}

/// A run that can be repeated.
struct Trial<'a> {
    scheme: Discretisation<'a>,
    outcome: Result<Found, RunErrorKind>,
    spent: Duration,
}

/// The result of a run that reached its end.
struct Found {
    seen: Seen,
    error: f64,
    /// The distance from the run with twice the step; infinite if there is none, or if the comparison is meaningless.
    change: f64,
    seconds: f64,
    repetitions: u32,
}

/// The error of a run is that of the model if doubling the step changes the run by less than this fraction of it.
const SETTLED: f64 = 0.5;

impl<'a> Search<'a> {
    pub(super) fn new(rung: &'a dyn Runs, outputs: Outputs<'a>, truth: &'a Truth) -> Self {
        Self {
            rung,
            outputs,
            truth,
            trials: Vec::new(),
        }
    }

    /// Makes runs with one element and decreasing steps, until shorter ones are not useful.
    pub(super) fn halve(&mut self, element: Element, grids: &'a [Grid], smallest: f64) {
        let mut end = End::new(smallest);
        let mut last = None;
        for grid in grids {
            let scheme = Discretisation {
                element,
                control: Control::default(),
                grid,
            };
            let seen = self
                .rung
                .check_start(grid)
                .and_then(|()| self.rung.look(scheme, self.outputs));
            let outcome = seen.map(|seen| self.found(seen, last.take()));
            let is_last = match &outcome {
                Ok(found) => {
                    last = Some(found.seen.rows.clone());
                    end.is_reached(found)
                }
                Err(kind) => {
                    end.forget();
                    is_of_every_step(kind)
                }
            };
            let spent = outcome.as_ref().map_or(Duration::ZERO, |one| one.seen.time);
            self.trials.push(Trial {
                scheme,
                outcome,
                spent,
            });
            if is_last {
                break;
            }
        }
    }

    fn found(&self, seen: Seen, last: Option<Vec<Vec<f64>>>) -> Found {
        // Steps that were cut may have the same pieces as those of twice the length; the runs then agree whatever their
        // error.
        let last = last.filter(|_| seen.statistics.cuts == 0);
        Found {
            error: self.truth.error(&seen.rows),
            change: last.map_or(f64::INFINITY, |last| self.truth.distance(&seen.rows, &last)),
            seconds: seen.time.as_secs_f64(),
            repetitions: 1,
            seen,
        }
    }

    /// Repeats all runs, each until it has taken the time `until` in total.
    pub(super) fn repeat(&mut self, until: Duration) {
        for trial in &mut self.trials {
            let Ok(found) = &mut trial.outcome else {
                continue;
            };
            let best = Best {
                seconds: &mut found.seconds,
                repetitions: &mut found.repetitions,
                spent: &mut trial.spent,
            };
            // The same run succeeded before.
            best.repeat(until, || self.rung.time(trial.scheme).ok());
        }
    }

    /// The error that no element and no step reduces: that of the run which changes least if its step is doubled.
    fn model_error(&self) -> Option<f64> {
        let found = self
            .trials
            .iter()
            .filter_map(|one| one.outcome.as_ref().ok());
        let settled = found.filter(|one| one.change <= SETTLED * one.error);
        let least = settled.min_by(|a, b| a.change.total_cmp(&b.change));
        least.map(|one| one.error)
    }

    /// Raises the errors to at least that of the model (a smaller one is due to chance cancellation by numerical
    /// errors) and the uncertainty of the reference. A model error below the smallest accuracy cannot be distinguished
    /// from rounding errors, and is dropped.
    pub(super) fn into_rung(self, name: &str, is_truth: bool, smallest: f64) -> Rung {
        let floor = self.model_error().filter(|_| !is_truth);
        let least = self.truth.summary().uncertainty();
        let least = floor.map_or(least, |error| error.max(least));
        let point = |trial: Trial<'_>| {
            let (element, step) = (trial.scheme.element, trial.scheme.grid.step());
            let choice = |found: Found| Choice {
                rung: name.to_owned(),
                element,
                step,
                error: at_least(found.error, least),
                distance: found.error,
                seconds: found.seconds,
                repetitions: found.repetitions,
                evaluations: found.seen.statistics.residual_evaluations
                    + found.seen.statistics.tangent_evaluations,
                statistics: found.seen.statistics,
            };
            RungPoint {
                element,
                step,
                outcome: trial.outcome.map(choice),
            }
        };
        Rung {
            name: name.to_owned(),
            points: self.trials.into_iter().map(point).collect(),
            model_error: floor.filter(|error| *error > smallest),
        }
    }
}

/// `f64::max` would ignore a NaN.
fn at_least(error: f64, least: f64) -> f64 {
    if error < least { least } else { error }
}

/// Whether a run fails for a reason that does not depend on the step.
fn is_of_every_step(kind: &RunErrorKind) -> bool {
    matches!(
        kind,
        RunErrorKind::Element(_)
            | RunErrorKind::Family(_)
            | RunErrorKind::Start { .. }
            | RunErrorKind::Inconsistent { .. }
    )
}

/// Detects when shorter steps are not useful.
struct End {
    /// The smallest accuracy that is asked for.
    smallest: f64,
    before: Option<f64>,
    /// The number of successive runs that have not reduced the error.
    flat: u32,
    /// The number of successive runs that were accurate enough.
    enough: u32,
}

impl End {
    fn new(smallest: f64) -> Self {
        Self {
            smallest,
            before: None,
            flat: 0,
            enough: 0,
        }
    }

    /// Called after a run that failed.
    fn forget(&mut self) {
        (self.before, self.flat, self.enough) = (None, 0, 0);
    }

    /// Called after a run: whether in two successive runs the error did not decrease by 30 %, or was small enough. A
    /// run whose error does not decrease because steps are still too long is recognised by its large change, and not
    /// counted.
    fn is_reached(&mut self, found: &Found) -> bool {
        /// The largest ratio of successive errors that counts as a decrease.
        const FALLS: f64 = 0.7;
        /// Below this, errors that do not decrease are rounding errors.
        const RESOLVED: f64 = 1e-6;
        let error = found.error;
        let is_resolved = found.change <= SETTLED * error || error < RESOLVED;
        let is_flat = self.before.is_some_and(|before| !(error < FALLS * before)) && is_resolved;
        self.flat = if is_flat { self.flat + 1 } else { 0 };
        self.enough = if error <= self.smallest {
            self.enough + 1
        } else {
            0
        };
        self.before = Some(error);
        self.flat >= 2 || self.enough >= 2
    }
}
