//! Ensembles that can be continued.

use super::batch::{AnyBatch, Resumed, Stepped};
use super::doubts::{Energy, WarningCounts};
use super::ends::{Ends, Outcome};
use super::error::EnsembleError;
use super::members::{Members, Models, OneModel, some_starts};
use super::plan::{Plan, WIDTH, start_of};
use super::results::{Results, lock, summed, unlock};
use super::setup::Ensemble;
use crate::length::{Declared, FixedLength, Length, RunTimeLength};
use crate::progress::Progress;
use crate::simulation::mesh::Mesh;
use crate::simulation::times::AtEnds;
use crate::simulation::{Reached, Simulated};
use std::fmt;
use std::sync::Mutex;
use tfe_runtime::family::{self, FamilyState};
use tfe_runtime::{Model, State};

/// An ensemble that is advanced in parts: made by [`Ensemble::begin`], advanced by [`run_to`](Self::run_to).
///
/// It holds the memory of a stepper for each trajectory, or of a [`Bundle`](tfe_runtime::bundle::Bundle) for eight of
/// them: some kilobytes each for a few coordinates. A clone is a checkpoint.
pub struct EnsembleRun<
    'm,
    M: 'm,
    const N: usize,
    K: Models<'m, M> = OneModel<'m, M>,
    L: Length<N> = FixedLength,
> {
    ensemble: Ensemble<'m, M, N, K, L>,
    reached: Reached,
    batches: Vec<AnyBatch<'m, M, N, K, L>>,
    /// The number of trajectories of each batch except the last.
    width: usize,
    /// The energy of each run at its current state.
    energies: Vec<Energy>,
}

// Not derived: the models are borrowed, they need not be `Clone`.
impl<'m, M, const N: usize, K: Models<'m, M>, L: Length<N>> Clone for EnsembleRun<'m, M, N, K, L> {
    fn clone(&self) -> Self {
        Self {
            ensemble: self.ensemble.clone(),
            reached: self.reached.clone(),
            batches: self.batches.iter().map(|batch| batch.copied()).collect(),
            width: self.width,
            energies: self.energies.clone(),
        }
    }
}

impl<'m, M, const N: usize, K: Models<'m, M>, L: Length<N>> fmt::Debug
    for EnsembleRun<'m, M, N, K, L>
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("EnsembleRun")
            .field("reached", &self.reached)
            .field("runs", &self.energies.len())
            .finish_non_exhaustive()
    }
}

impl<'m, M, const N: usize, K> Ensemble<'m, M, N, K>
where
    M: Model<N> + Sync,
    K: Members<'m, M, N>,
{
    /// Places all trajectories at their starts, at the time `t0`; [`EnsembleRun::run_to`] advances them. Use it for
    /// results at several times, which have the same bits as in one run:
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
    /// [`EnsembleError::Run`] if the element does not exist, [`EnsembleError::Starts`] if the number of starts does not fit
    /// the number of models. An invalid start fails its own run only.
    pub fn begin(
        &self,
        starts: &[State<N>],
        t0: f64,
    ) -> Result<EnsembleRun<'m, M, N, K>, EnsembleError> {
        if self.is_watched() {
            return self.begin_one_by_one(starts, t0);
        }
        let width = self.width();
        self.begin_with(starts, t0, width, &|first, count| {
            let starts = match width {
                WIDTH => some_starts(starts, first, count),
                _ => vec![*start_of(starts, first)],
            };
            Box::new(Stepped::At(starts))
        })
    }
}

impl<'m, M, K> Ensemble<'m, M, 0, K, RunTimeLength>
where
    M: family::Model + Sync,
    K: Models<'m, M>,
{
    /// Places all trajectories at their starts, at the time `t0`; [`EnsembleRun::run_to`] advances them. Use it for
    /// results at several times, which have the same bits as in one run:
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1] - q[i])^4/4))]
    /// struct Chain { n: usize }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let chain = Chain { n: 5 };
    /// let starts: Vec<_> = (0..4).map(|k| chain.state(vec![0.0; 5], vec![f64::from(k), 0.0, 0.0, 0.0, 0.0])).collect();
    /// let ensemble = Ensemble::new(&chain).step(0.1);
    /// let mut run = ensemble.begin(&starts, 0.0)?;
    /// let middle = run.run_to(3.0)?;
    /// let end = run.run_to(10.0)?;
    /// assert_eq!(middle[3], ensemble.run(&starts, 0.0..3.0)?[3]);
    /// assert_eq!(end[3], ensemble.run(&starts, 0.0..10.0)?[3]);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`EnsembleError::Run`] if the element does not exist, [`EnsembleError::Starts`] if the number of starts does not fit
    /// the number of models. An invalid start fails its own run only.
    pub fn begin(
        &self,
        starts: &[FamilyState],
        t0: f64,
    ) -> Result<EnsembleRun<'m, M, 0, K, RunTimeLength>, EnsembleError> {
        self.begin_one_by_one(starts, t0)
    }
}

impl<'m, M, const N: usize, K, L> Ensemble<'m, M, N, K, L>
where
    M: Simulated<N, L> + Declared<N, Length = L>,
    K: Models<'m, M>,
    L: Length<N>,
{
    /// Begins runs that are made one by one by a [`Simulation`](crate::Simulation).
    fn begin_one_by_one(
        &self,
        starts: &[L::State],
        t0: f64,
    ) -> Result<EnsembleRun<'m, M, N, K, L>, EnsembleError> {
        self.begin_with(starts, t0, 1, &|index, _| {
            Box::new(Resumed::At(t0, start_of(starts, index).clone()))
        })
    }

    /// Begins batches of `width` runs; `batch` creates one from the index of its first run and the number of all runs.
    fn begin_with(
        &self,
        starts: &[L::State],
        t0: f64,
        width: usize,
        batch: &dyn Fn(usize, usize) -> AnyBatch<'m, M, N, K, L>,
    ) -> Result<EnsembleRun<'m, M, N, K, L>, EnsembleError> {
        let count = self.models.count(starts.len())?;
        self.check_method()?;
        let mut energies = Vec::with_capacity(count);
        for index in 0..count {
            let (model, start) = (self.models.model(index), start_of(starts, index));
            energies.push(match model.check_start(start, &[]) {
                Ok(()) => model
                    .guarded(|| Energy::of(model, t0, start))
                    .unwrap_or(Energy::UNKNOWN),
                Err(_) => Energy::UNKNOWN,
            });
        }
        let mut batches = Vec::with_capacity(count.div_ceil(width));
        for first in (0..count).step_by(width) {
            batches.push(batch(first, count));
        }
        Ok(EnsembleRun {
            ensemble: self.clone(),
            reached: Reached {
                origin: t0,
                step: self.step,
                elements: 0,
                time: t0,
                direction: 0.0,
            },
            batches,
            width,
            energies,
        })
    }
}

impl<'m, M, const N: usize, K, L> EnsembleRun<'m, M, N, K, L>
where
    M: Simulated<N, L> + Sync,
    K: Models<'m, M>,
    L: Length<N>,
{
    /// The time that has been reached.
    pub fn time(&self) -> f64 {
        self.reached.time
    }

    /// Continues all trajectories to the time `end`. A run that has failed keeps its error, and one that an event has
    /// stopped stays at that event. A run whose events have [set](crate::Act::Set) parameters cannot be continued: its
    /// next result is [`RunErrorKind::Unsupported`](crate::RunErrorKind::Unsupported).
    ///
    /// If `end` lies on the grid of steps that begins at the first start, and the previous end did, the results have
    /// the same bits as in one run; otherwise the grid begins anew at the time reached. If no step size was set, it is
    /// one thousandth of the first span.
    ///
    /// # Errors
    /// [`EnsembleError::Run`] if the step size or the span is invalid; nothing is changed then.
    pub fn run_to(&mut self, end: f64) -> Result<Ends<N, L>, EnsembleError> {
        let Self {
            ensemble,
            reached,
            batches,
            width,
            energies,
        } = self;
        let length = (end - reached.time).abs();
        // The direction of the first span of nonzero length.
        let chosen = (reached.step).or_else(|| (length > 0.0).then_some(length / 1000.0));
        let step = chosen.unwrap_or(0.0);
        let (mesh, done, origin) = reached.place(end, None, &|span, _| {
            let at_ends = AtEnds::of(ensemble.element, M::IS_CONSTRAINED);
            Ok(Mesh::new(span, step, &ensemble.breaks, &[])?.with(at_ends))
        })?;
        let next = Reached::new((origin, reached.direction), chosen, &mesh, end);
        let plan = Plan {
            element: ensemble.element,
            control: ensemble.control,
            end,
            step,
            mesh,
            done,
            width: *width,
        };
        let mut places = Vec::with_capacity(batches.len());
        for batch in batches {
            places.push(Mutex::new(batch));
        }
        let count = energies.len();
        let results = Mutex::new((Results::new(count), energies));
        let progress = Progress::new(ensemble.progress, count, "runs");
        let statistics = summed(
            places.len(),
            || (),
            |_: &mut (), number| {
                let mut batch = lock(&places[number]);
                let first = number * *width;
                let finished = |lane: usize, result: Outcome<N, L>| {
                    let index = first + lane;
                    let model = ensemble.models.model(index);
                    let node = result.as_ref().ok();
                    let after = node.map(|node| Energy::at(model, node));
                    let mut results = lock(&results);
                    let (results, energies) = &mut *results;
                    let mut warnings = WarningCounts::default();
                    if let (Some(before), Some(after)) = (energies.get_mut(index), after) {
                        let rounding = || node.map_or(0.0, |node| model.rounding_at(node, length));
                        let conserves = ensemble.conserves();
                        warnings = WarningCounts::of(conserves, *before, after, &rounding);
                        *before = after;
                    }
                    results.put(index, result, warnings);
                };
                let statistics = batch.drive(ensemble, &plan, first, &finished);
                progress.advance(batch.count());
                statistics
            },
        );
        *reached = next;
        let (results, _) = unlock(results);
        Ok(results.into_ends(statistics))
    }
}
