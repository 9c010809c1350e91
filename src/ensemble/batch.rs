//! Batches: the trajectories of a resumable ensemble that one thread advances at a time.

use super::ends::Outcome;
use super::members::{Members, Models};
use super::plan::{Failures, Plan, WIDTH, bad_starts};
use super::setup::Ensemble;
use super::watched::outcome;
use crate::error::RunErrorKind;
use crate::length::{Declared, FixedLength, Length};
use crate::motion::Checkpoint;
use crate::simulation::Simulated;
use tfe_runtime::bundle::Bundle;
use tfe_runtime::step::Stepper;
use tfe_runtime::{Model, State, Statistics};

/// Trajectories that are advanced one after the other, or side by side in vector lanes.
pub(super) trait Batch<'m, M, const N: usize, K, L: Length<N>>: Send + Sync {
    /// The number of trajectories.
    fn count(&self) -> usize;

    /// Advances the runs over the rest of the mesh; `first` is the index of the first one in the ensemble. `finished`
    /// is called with the index within the batch.
    fn drive(
        &mut self,
        ensemble: &Ensemble<'m, M, N, K, L>,
        plan: &Plan<N>,
        first: usize,
        finished: &dyn Fn(usize, Outcome<N, L>),
    ) -> Statistics;

    /// A clone.
    fn copied(&self) -> AnyBatch<'m, M, N, K, L>;
}

pub(super) type AnyBatch<'m, M, const N: usize, K, L> = Box<dyn Batch<'m, M, N, K, L> + 'm>;

/// A single resumable run, made by a [`Simulation`](crate::Simulation).
pub(super) enum Resumed<const N: usize, L: Length<N>> {
    /// Not begun.
    At(f64, L::State),
    Going(Box<Checkpoint<N, L>>),
    /// Ended by an event or an error.
    Ended(Box<Outcome<N, L>>),
}

impl<const N: usize, L: Length<N>> Clone for Resumed<N, L> {
    fn clone(&self) -> Self {
        match self {
            Self::At(time, start) => Self::At(*time, start.clone()),
            Self::Going(checkpoint) => Self::Going(checkpoint.clone()),
            Self::Ended(outcome) => Self::Ended(outcome.clone()),
        }
    }
}

impl<'m, M, const N: usize, K, L> Batch<'m, M, N, K, L> for Resumed<N, L>
where
    M: Simulated<N, L> + Declared<N, Length = L>,
    K: Models<'m, M>,
    L: Length<N>,
{
    fn count(&self) -> usize {
        1
    }

    fn drive(
        &mut self,
        ensemble: &Ensemble<'m, M, N, K, L>,
        plan: &Plan<N>,
        first: usize,
        finished: &dyn Fn(usize, Outcome<N, L>),
    ) -> Statistics {
        let model = ensemble.models.model(first);
        let run = ensemble.simulation(model, plan.step);
        let motion = match self {
            Self::At(time, start) => run.run(start.clone(), *time..plan.end),
            Self::Going(checkpoint) => run.resume(checkpoint, plan.end),
            Self::Ended(outcome) => {
                finished(0, (**outcome).clone());
                return Statistics::default();
            }
        };
        let (outcome, statistics) = outcome(model, &motion);
        *self = match &motion {
            Ok(motion) => match motion.checkpoint() {
                Some(checkpoint) => Self::Going(Box::new(checkpoint.clone())),
                // Stopped by an event; a run whose parameters were set cannot be resumed.
                None if motion.settings().is_empty() || motion.last().t != plan.end => {
                    Self::Ended(Box::new(outcome.clone()))
                }
                None => Self::Ended(Box::new(Err(RunErrorKind::Unsupported {
                    call: "EnsembleRun::run_to",
                    of: "runs whose events have set parameters",
                }))),
            },
            Err(_) => Self::Ended(Box::new(outcome.clone())),
        };
        finished(0, outcome);
        statistics
    }

    fn copied(&self) -> AnyBatch<'m, M, N, K, L> {
        Box::new(self.clone())
    }
}

/// Runs of a model of fixed size without events, advanced step by step.
pub(super) enum Stepped<'m, M, const N: usize, T> {
    /// Not begun: the starts.
    At(Vec<State<N>>),
    Lanes(Box<Lanes<'m, M, N, T>>),
    Alone(Box<(Stepper<'m, M, N>, State<N>)>),
    Failed(RunErrorKind),
}

pub(super) struct Lanes<'m, M, const N: usize, T> {
    bundle: Bundle<'m, M, N, WIDTH, T>,
    failures: Failures,
    count: usize,
}

impl<'m, M, const N: usize, K> Batch<'m, M, N, K, FixedLength> for Stepped<'m, M, N, K::Lanes>
where
    M: Model<N> + Sync,
    K: Members<'m, M, N>,
{
    fn count(&self) -> usize {
        match self {
            Self::At(starts) => starts.len(),
            Self::Lanes(lanes) => lanes.count,
            Self::Alone(_) | Self::Failed(_) => 1,
        }
    }

    fn drive(
        &mut self,
        ensemble: &Ensemble<'m, M, N, K>,
        plan: &Plan<N>,
        first: usize,
        finished: &dyn Fn(usize, Outcome<N, FixedLength>),
    ) -> Statistics {
        if let Self::At(starts) = self {
            if plan.mesh.steps() == 0 {
                // The first element checks the constraints.
                for (lane, start) in starts.iter().enumerate() {
                    let model = ensemble.models.model(first + lane);
                    finished(lane, plan.at_rest(model, start));
                }
                return Statistics::default();
            }
            *self = Self::begin(ensemble, plan, first, starts);
        }
        match self {
            // It was created above.
            Self::At(_) => Statistics::default(),
            Self::Lanes(lanes) => {
                let Lanes {
                    bundle,
                    failures,
                    count,
                } = &mut **lanes;
                plan.drive_together(bundle, *count, failures, finished)
            }
            Self::Alone(one) => {
                let (stepper, state) = &mut **one;
                let outcome = plan.drive_alone(stepper, state);
                let statistics = stepper.take_statistics();
                finished(0, outcome.clone());
                if let Err(kind) = outcome {
                    *self = Self::Failed(kind);
                }
                statistics
            }
            Self::Failed(kind) => {
                finished(0, Err(kind.clone()));
                Statistics::default()
            }
        }
    }

    fn copied(&self) -> AnyBatch<'m, M, N, K, FixedLength> {
        Box::new(match self {
            Self::At(starts) => Self::At(starts.clone()),
            Self::Lanes(lanes) => Self::Lanes(Box::new(Lanes {
                bundle: lanes.bundle.clone(),
                failures: lanes.failures.clone(),
                count: lanes.count,
            })),
            Self::Alone(one) => Self::Alone(Box::new((one.0.clone(), one.1))),
            Self::Failed(kind) => Self::Failed(kind.clone()),
        })
    }
}

impl<'m, M: Model<N> + Sync, const N: usize, T> Stepped<'m, M, N, T> {
    /// Creates the stepper of the runs from `first` on, one for each start.
    fn begin<K: Members<'m, M, N, Lanes = T>>(
        ensemble: &Ensemble<'m, M, N, K>,
        plan: &Plan<N>,
        first: usize,
        starts: &[State<N>],
    ) -> Self {
        let models = &ensemble.models;
        if plan.width == WIDTH {
            return match models.bundle(plan.element, plan.control) {
                Ok(mut bundle) => {
                    models.place(&mut bundle, first, starts);
                    Self::Lanes(Box::new(Lanes {
                        bundle,
                        failures: bad_starts(starts),
                        count: starts.len(),
                    }))
                }
                Err(error) => Self::Failed(RunErrorKind::of_stepper(error)),
            };
        }
        let Some(&start) = starts.first() else {
            return Self::At(Vec::new());
        };
        match plan.stepper(models.model(first), &start) {
            Ok(stepper) => Self::Alone(Box::new((stepper, start))),
            Err(kind) => Self::Failed(kind),
        }
    }
}
