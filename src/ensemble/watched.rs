//! Ensembles whose runs look for events or are cut at kinks.

use super::doubts::{Energy, WarningCounts};
use super::ends::{Finished, Outcome};
use super::members::Models;
use super::plan::start_of;
use super::results::summed;
use super::setup::Ensemble;
use crate::error::{RunError, RunErrorKind};
use crate::evaluate::Evaluate;
use crate::length::{Declared, Length};
use crate::motion::{Motion, Node};
use crate::progress::Progress;
use crate::simulation::{Act, Crossing, Occurrence, Settable, Simulated, Simulation};
use std::ops::Range;
use std::sync::Arc;
use tfe_runtime::Statistics;

impl<'m, M, const N: usize, K, L> Ensemble<'m, M, N, K, L>
where
    M: Settable<'m, N, L>,
    L: Length<N>,
{
    /// Calls `act` at events of every run, as [`Simulation::on`] does. Runs are then made one by one, on all
    /// processors; a run that an event stops ends there, with the node at the event.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A ball in a well with a floor.
    /// #[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - g*y, event(impact) = y)]
    /// struct Ball { g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Ball { g: 9.81 };
    /// let starts: Vec<_> = (1..=20).map(|k| ball.state([0.1 * f64::from(k)], [0.0])).collect();
    /// let ends = Ensemble::new(&ball)
    ///     .step(0.1)
    ///     .on("impact", Crossing::Falling, |_| Act::Stop)
    ///     .run(&starts, 0.0..10.0)?;
    /// for (start, end) in starts.iter().zip(ends.nodes()) {
    ///     assert!((end.t - (2.0 * start.q[0] / 9.81).sqrt()).abs() < 1e-14);
    /// }
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn on(
        mut self,
        name: impl Into<String>,
        crossing: Crossing,
        act: impl Fn(&Occurrence<'_, N, L>) -> Act<N, L> + Send + Sync + 'm,
    ) -> Self {
        self.events.push(name.into(), crossing, None, Arc::new(act));
        self
    }
}

impl<'m, M, const N: usize, K, L> Ensemble<'m, M, N, K, L>
where
    M: Simulated<N, L> + Declared<N, Length = L> + Sync,
    K: Models<'m, M>,
    L: Length<N>,
{
    /// So many runs, each by itself, on all processors; what they have cost together.
    pub(super) fn run_one_by_one(
        &self,
        starts: &[L::State],
        span: &Range<f64>,
        (count, progress): (usize, &Progress),
        finished: &Finished<'_, N, L>,
    ) -> Statistics {
        summed(
            count,
            || (),
            |_: &mut (), index| {
                let (model, start) = (self.models.model(index), start_of(starts, index));
                let (result, statistics) = self.run_one(model, start, span);
                finished(index, result);
                progress.advance(1);
                statistics
            },
        )
    }
}

impl<'m, M, const N: usize, K, L> Ensemble<'m, M, N, K, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// Makes one run by a [`Simulation`], with its events and kinks.
    fn run_one(
        &self,
        model: &'m M,
        start: &L::State,
        span: &Range<f64>,
    ) -> (Outcome<N, L>, Statistics)
    where
        M: Declared<N, Length = L>,
    {
        let step = self.step_over(span);
        let run = self.simulation(model, step);
        outcome(model, &run.run(start.clone(), span.clone()))
    }

    /// A simulation with the settings of the ensemble.
    pub(super) fn simulation(&self, model: &'m M, step: f64) -> Simulation<'m, M, N, L>
    where
        M: Declared<N, Length = L>,
    {
        let run = Simulation::new(model)
            .element(self.element)
            .step(step)
            .record_every(usize::MAX)
            .at_kinks(self.at_kinks)
            .with_control(self.control)
            .watching(&self.events);
        let breaks = self.breaks.iter();
        breaks.fold(run, |run, time| run.break_at(*time))
    }

    /// The warnings of one run that reached its end.
    pub(super) fn doubts(
        &self,
        model: &M,
        (from, start): (f64, &L::State),
        result: &Result<Node<N, L>, RunErrorKind>,
    ) -> WarningCounts {
        result.as_ref().map_or_else(
            |_| WarningCounts::default(),
            |node| {
                let before = Energy::of(model, from, start);
                let after = Energy::at(model, node);
                let rounding = || model.rounding_at(node, node.t - from);
                WarningCounts::of(self.conserves(), before, after, &rounding)
            },
        )
    }

    /// Whether energies should be conserved; events may change them.
    pub(super) fn conserves(&self) -> bool {
        M::CONSERVES && self.events.is_empty()
    }
}

/// The end of a run and its work. The velocity at the end is found by iteration from zero, as for trajectories side by
/// side, not from that of another node: the result does not depend, to the bit, on how the run is divided.
pub(super) fn outcome<M, const N: usize, L>(
    model: &M,
    run: &Result<Motion<N, L>, RunError<N, L>>,
) -> (Outcome<N, L>, Statistics)
where
    M: Evaluate<N, L>,
    L: Length<N>,
{
    let motion = match run {
        Ok(motion) => motion,
        Err(error) => return (Err(error.kind().clone()), *error.partial().statistics()),
    };
    let last = motion.last();
    let from_rest = || Node::new(model, last.t, &last.state(), &L::zero(&last.q));
    // The parameters that events have set differ from those of the model.
    let is_unchanged = motion.settings().is_empty();
    let node = is_unchanged.then(from_rest).filter(|node| {
        let mut velocity = node.v.as_ref().iter();
        velocity.all(|v| v.is_finite())
    });
    (
        Ok(node.unwrap_or_else(|| last.clone())),
        *motion.statistics(),
    )
}
