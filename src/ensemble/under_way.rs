//! Ensembles that go on where they have got to.

use super::doubts::{Energy, WarningCounts};
use super::ends::Ends;
use super::error::EnsembleError;
use super::members::{Members, OneModel, some_starts};
use super::plan::{Failures, Plan, WIDTH, bad_starts, start_of};
use super::results::{Results, lock, summed, unlock};
use super::setup::Ensemble;
use crate::error::RunErrorKind;
use crate::length::FixedLength;
use crate::motion::Node;
use crate::progress::Progress;
use crate::simulation::mesh::Mesh;
use crate::simulation::{Reached, Simulated};
use std::sync::Mutex;
use tfe_runtime::bundle::{Bundle, Trajectories};
use tfe_runtime::step::Stepper;
use tfe_runtime::{Model, State, Statistics};

/// An ensemble under way: made by [`Ensemble::begin`], moved by [`run_to`](Self::run_to).
///
/// It holds the memory of a stepper for each trajectory, or of a [`Bundle`] for eight: some kilobytes each for a few coordinates. A clone is a checkpoint.
#[derive(Debug)]
pub struct EnsembleRun<'m, M: Model<N>, const N: usize, K: Members<'m, M, N> = OneModel<'m, M>> {
    ensemble: Ensemble<'m, M, N, K>,
    reached: Reached,
    batches: Vec<Batch<'m, M, N, K::Lanes>>,
    /// Of each run where it is.
    energies: Vec<Energy>,
}

// Not derived: the models are borrowed, they need not be `Clone`.
impl<'m, M: Model<N>, const N: usize, K: Members<'m, M, N>> Clone for EnsembleRun<'m, M, N, K> {
    fn clone(&self) -> Self {
        Self {
            ensemble: self.ensemble.clone(),
            reached: self.reached.clone(),
            batches: self.batches.clone(),
            energies: self.energies.clone(),
        }
    }
}

/// Trajectories that are run one after the other on one processor.
#[derive(Debug)]
enum Batch<'m, M, const N: usize, T> {
    /// Not begun: the starts.
    At(Vec<State<N>>),
    Lanes(Box<Lanes<'m, M, N, T>>),
    Alone(Box<(Stepper<'m, M, N>, State<N>)>),
    Failed(RunErrorKind),
}

#[derive(Debug)]
struct Lanes<'m, M, const N: usize, T> {
    bundle: Bundle<'m, M, N, WIDTH, T>,
    failures: Failures,
    count: usize,
}

impl<M: Model<N>, const N: usize, T: Clone> Clone for Batch<'_, M, N, T> {
    fn clone(&self) -> Self {
        match self {
            Self::At(starts) => Self::At(starts.clone()),
            Self::Lanes(lanes) => {
                let Lanes {
                    bundle,
                    failures,
                    count,
                } = &**lanes;
                Self::Lanes(Box::new(Lanes {
                    bundle: bundle.clone(),
                    failures: failures.clone(),
                    count: *count,
                }))
            }
            Self::Alone(one) => Self::Alone(Box::new((one.0.clone(), one.1))),
            Self::Failed(kind) => Self::Failed(kind.clone()),
        }
    }
}

impl<'m, M, const N: usize, K> Ensemble<'m, M, N, K>
where
    M: Model<N> + Sync,
    K: Members<'m, M, N>,
{
    /// Places all trajectories at their starts, at the time `t0`; [`EnsembleRun::run_to`] moves them. For results at several times, as one run would pass them to the bit:
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + cos(theta))]
    /// struct Pendulum {}
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let pendulum = Pendulum {};
    /// let starts: Vec<_> = (0..20).map(|k| pendulum.state([0.1 * f64::from(k)], [0.0])).collect();
    /// let ensemble = Ensemble::new(&pendulum).step(0.1);
    /// let mut run = ensemble.begin(&starts, 0.0)?;
    /// let middle = run.run_to(3.0)?;
    /// let end = run.run_to(10.0)?;
    /// assert_eq!(middle[19], ensemble.run(&starts, 0.0..3.0)?[19]);
    /// assert_eq!(end[19], ensemble.run(&starts, 0.0..10.0)?[19]);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`EnsembleError`] where the element does not exist, the number of starts is not that of models, or [events](Ensemble::on) are to be looked for, or steps to be cut at
    /// [kinks](Ensemble::at_kinks), which [`run`](Ensemble::run) and [`for_each`](Ensemble::for_each) do. A bad start is a failure of its own run only.
    pub fn begin(
        &self,
        starts: &[State<N>],
        t0: f64,
    ) -> Result<EnsembleRun<'m, M, N, K>, EnsembleError> {
        let count = self.models.count(starts.len())?;
        if !self.events.is_empty() {
            let call = "Ensemble::begin";
            return Err(RunErrorKind::EventsUnsupported { call }.into());
        }
        if self.is_watched() {
            let call = "Ensemble::begin";
            return Err(RunErrorKind::KinksUnsupported { call }.into());
        }
        self.element.validate().map_err(RunErrorKind::Element)?;
        let batches = match self.width() {
            WIDTH => (0..count)
                .step_by(WIDTH)
                .map(|first| Batch::At(some_starts(starts, first, count)))
                .collect(),
            _ => (0..count)
                .map(|index| Batch::At(vec![*start_of(starts, index)]))
                .collect(),
        };
        Ok(EnsembleRun {
            ensemble: self.clone(),
            reached: Reached {
                origin: t0,
                step: self.step,
                elements: 0,
                time: t0,
            },
            batches,
            energies: (0..count)
                .map(|index| Energy::of(self.models.model(index), t0, start_of(starts, index)))
                .collect(),
        })
    }
}

impl<'m, M, const N: usize, K> EnsembleRun<'m, M, N, K>
where
    M: Model<N> + Sync,
    K: Members<'m, M, N>,
{
    /// The time that has been reached.
    pub fn time(&self) -> f64 {
        self.reached.time
    }

    /// Runs all trajectories on to the time `end`. What has failed stays so.
    ///
    /// Where that time lies on the grid of steps from the first start, and the last one did, the results are to the last bit those of one run; else the grid begins anew where the
    /// ensemble is. Without a step of one's own it is a thousandth of the first span.
    ///
    /// # Errors
    /// [`EnsembleError`] where step or span are not finite; nothing is changed then.
    pub fn run_to(&mut self, end: f64) -> Result<Ends<N>, EnsembleError> {
        let Self {
            ensemble,
            reached,
            batches,
            energies,
        } = self;
        let length = (end - reached.time).abs();
        // Of the first span that has a length.
        let chosen = (reached.step).or_else(|| (length > 0.0).then_some(length / 1000.0));
        let (mesh, done, origin) = reached.place(end, None, |span, _| {
            Mesh::new(span, chosen.unwrap_or(0.0), &ensemble.breaks, &[])
        })?;
        let next = Reached::new(origin, chosen, &mesh, end);
        let plan = Plan {
            element: ensemble.element,
            control: ensemble.control,
            end,
            mesh,
            done,
        };
        let width = ensemble.width();
        let places: Vec<_> = std::mem::take(batches)
            .into_iter()
            .map(Mutex::new)
            .collect();
        let count = energies.len();
        let results = Mutex::new((Results::new(count), energies));
        let progress = Progress::new(ensemble.progress, count, "runs");
        let statistics = summed(
            places.len(),
            || (),
            |_: &mut (), number| {
                let mut batch = lock(&places[number]);
                let finished = |lane: usize, result: Result<Node<N>, RunErrorKind>| {
                    let index = number * width + lane;
                    let model = ensemble.models.model(index);
                    let after = result.as_ref().ok();
                    let after = after.map(|node| Energy::of(model, end, &node.state()));
                    let mut results = lock(&results);
                    let (results, energies) = &mut *results;
                    let mut warnings = WarningCounts::default();
                    if let (Some(before), Some(after)) = (energies.get_mut(index), after) {
                        warnings = WarningCounts::of(
                            <M as Simulated<N, FixedLength>>::CONSERVES,
                            *before,
                            after,
                        );
                        *before = after;
                    }
                    results.put(index, result, warnings);
                };
                let place = (&ensemble.models, number * width, width);
                let statistics = batch.drive(&plan, place, finished);
                progress.advance(batch.count());
                statistics
            },
        );
        *batches = places.into_iter().map(unlock).collect();
        *reached = next;
        let (results, _) = unlock(results);
        Ok(results.into_ends(statistics))
    }
}

impl<'m, M: Model<N>, const N: usize, T: Trajectories<'m, M, N>> Batch<'m, M, N, T> {
    /// How many trajectories it has.
    fn count(&self) -> usize {
        match self {
            Self::At(starts) => starts.len(),
            Self::Lanes(lanes) => lanes.count,
            Self::Alone(_) | Self::Failed(_) => 1,
        }
    }

    /// Over the rest of the mesh.
    fn drive<K: Members<'m, M, N, Lanes = T>>(
        &mut self,
        plan: &Plan<N>,
        place: (&K, usize, usize),
        finished: impl Fn(usize, Result<Node<N>, RunErrorKind>),
    ) -> Statistics {
        if let Self::At(starts) = self {
            *self = Self::begin(plan, place, starts);
        }
        match self {
            // Made above.
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

    /// The runs from `first` on, so many at a time.
    fn begin<K: Members<'m, M, N, Lanes = T>>(
        plan: &Plan<N>,
        (models, first, width): (&K, usize, usize),
        starts: &[State<N>],
    ) -> Self {
        if width == WIDTH {
            return match models.bundle(plan.element, plan.control) {
                Ok(mut bundle) => {
                    models.place(&mut bundle, first, starts);
                    let failures = bad_starts(starts);
                    let count = starts.len();
                    Self::Lanes(Box::new(Lanes {
                        bundle,
                        failures,
                        count,
                    }))
                }
                Err(error) => Self::Failed(RunErrorKind::Element(error)),
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
