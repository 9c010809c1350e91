//! The runs of one rung: steps halved until errors fall no more, then times.

use super::ladder::{Choice, Rung, RungPoint};
use super::rung::{Outputs, Runs, Seen};
use super::truth::Truth;
use crate::error::RunErrorKind;
use crate::work_precision::grid::Grid;
use crate::work_precision::measure::{Best, Way};
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

/// A run, which may be repeated.
struct Trial<'a> {
    way: Way<'a>,
    outcome: Result<Found, RunErrorKind>,
    spent: Duration,
}

/// What was found of a run that reached its end.
struct Found {
    seen: Seen,
    error: f64,
    /// The distance from the run with twice the step; infinite where there is none, or it tells nothing.
    change: f64,
    seconds: f64,
    repetitions: u32,
}

/// An error is the model's where twice the step changes the run by less than this part of it.
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

    /// Runs with one element and shorter and shorter steps, until there is no point in shorter ones.
    pub(super) fn halve(&mut self, element: Element, grids: &'a [Grid], smallest: f64) {
        let mut end = End::new(smallest);
        let mut last = None;
        for grid in grids {
            let way = Way {
                element,
                control: Control::default(),
                grid,
            };
            let seen = self
                .rung
                .check_start(grid)
                .and_then(|()| self.rung.look(way, self.outputs));
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
                way,
                outcome,
                spent,
            });
            if is_last {
                break;
            }
        }
    }

    fn found(&self, seen: Seen, last: Option<Vec<Vec<f64>>>) -> Found {
        // Steps that were cut have the pieces that those of twice the length have, and agree with them whatever they are off by.
        let last = last.filter(|_| seen.statistics.cuts == 0);
        Found {
            error: self.truth.error(&seen.rows),
            change: last.map_or(f64::INFINITY, |last| self.truth.distance(&seen.rows, &last)),
            seconds: seen.time.as_secs_f64(),
            repetitions: 1,
            seen,
        }
    }

    /// Repeats all runs, each until it has taken `until` in all.
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
            // It has run before, from the same start.
            best.repeat(until, || self.rung.time(trial.way).ok());
        }
    }

    /// The error that no element and no step makes smaller: that of the run which twice the step changes least.
    fn model_error(&self) -> Option<f64> {
        let found = self
            .trials
            .iter()
            .filter_map(|one| one.outcome.as_ref().ok());
        let settled = found.filter(|one| one.change <= SETTLED * one.error);
        let least = settled.min_by(|a, b| a.change.total_cmp(&b.change));
        least.map(|one| one.error)
    }

    /// With errors that are no smaller than that of the model (where numerical errors happen to cancel it, that is luck), nor than what the truth is known to.
    /// What is below the smallest accuracy is not told from roundings, and no error of the model.
    pub(super) fn into_rung(self, name: &str, is_truth: bool, smallest: f64) -> Rung {
        let floor = self.model_error().filter(|_| !is_truth);
        let least = self.truth.summary().uncertainty();
        let least = floor.map_or(least, |error| error.max(least));
        let point = |trial: Trial<'_>| {
            let (element, step) = (trial.way.element, trial.way.grid.step());
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

/// `f64::max` would drop a NaN.
fn at_least(error: f64, least: f64) -> f64 {
    if error < least { least } else { error }
}

/// Whether a run fails for a reason that no step changes.
fn is_of_every_step(kind: &RunErrorKind) -> bool {
    matches!(
        kind,
        RunErrorKind::Element(_)
            | RunErrorKind::Family(_)
            | RunErrorKind::Start { .. }
            | RunErrorKind::Inconsistent { .. }
    )
}

/// When shorter steps have no use.
struct End {
    /// The smallest accuracy that is asked for.
    smallest: f64,
    before: Option<f64>,
    /// How many runs in a row have not lowered the error.
    flat: u32,
    /// How many runs in a row were good enough.
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

    /// After a run that failed.
    fn forget(&mut self) {
        (self.before, self.flat, self.enough) = (None, 0, 0);
    }

    /// After a run: whether twice in a row the error did not fall by 30 %, or was small enough. One that does not fall because no step is short
    /// enough yet still changes with the step, and counts for nothing.
    fn is_reached(&mut self, found: &Found) -> bool {
        /// What a halved step must make of the error at most.
        const FALLS: f64 = 0.7;
        /// Below it, errors that do not fall are roundings.
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
