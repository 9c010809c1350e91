//! Records a run as a motion, and collects its warnings.

use super::events::Severed;
use super::follow::{Follow, Follower, Passed};
use super::kind::Simulated;
use super::pieces::{Broken, Observe, Side};
use super::resolution::Resolution;
use super::setup::Simulation;
use super::watch::{Recorded, Watch};
use crate::error::RunErrorKind;
use crate::length::Length;
use crate::motion::{Motion, Node, Warning};
use std::ops::ControlFlow;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Share, Statistics};

/// Records the elements that a run passes, and calls the follower.
pub(super) struct Recorder<'f, 'm, M, const N: usize, L: Length<N>> {
    record: Record<N, L>,
    follower: Follower<'f, 'm, M, N, L>,
    resolution: Resolution<'m, M, N, L>,
}

impl<'f, 'm, M, const N: usize, L> Recorder<'f, 'm, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// Begins with the only node of `motion`.
    pub(super) fn new(
        simulation: &Simulation<'m, M, N, L>,
        motion: Motion<N, L>,
        mut follower: Follower<'f, 'm, M, N, L>,
    ) -> Self {
        if let Some(follower) = &mut follower {
            follower.recorded(motion.last());
        }
        let mut watch = Watch::new(simulation.chosen_element());
        watch.begin(&motion, simulation.model.weigh(motion.last()));
        Self {
            resolution: Resolution::new(simulation.again()),
            record: Record {
                motion,
                watch,
                every: simulation.record_every,
                conserves: M::CONSERVES,
                is_conserved: M::CONSERVES,
            },
            follower,
        }
    }

    /// Called before an element.
    pub(super) fn begin(
        &mut self,
        model: &M,
        number: usize,
        at: (f64, f64),
        state: &L::State,
        has_impulses: bool,
    ) {
        model.look(&mut self.record.watch, number, at, state, false);
        self.record.is_conserved &= !has_impulses;
    }

    /// Called after an element that ends at `t`.
    pub(super) fn end(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        model: &M,
        (number, is_last): (usize, bool),
        (t, state): (f64, &L::State),
    ) {
        if !(is_last || self.record.is_due(number)) {
            return;
        }
        if !self.record.is_at(t) {
            self.record(stepper, model, (t, state));
            self.tell();
        }
        (self.record).check_energy(&|node, time| model.rounding_at(node, time));
    }

    /// Called after an element that failed.
    pub(super) fn fail(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        model: &M,
        number: usize,
        broken: &Broken<N, L>,
    ) {
        let Some((t, h, before)) = &broken.piece else {
            return;
        };
        model.look(&mut self.record.watch, number, (*t, *h), before, true);
        if !self.record.is_at(*t) {
            self.record(stepper, model, (*t, before));
        }
    }

    fn record(&mut self, stepper: &mut L::Stepper<'m, M>, model: &M, at: (f64, &L::State)) {
        M::record(&mut self.record.motion, stepper, model, at);
    }

    /// Passes the last node to the follower.
    fn tell(&mut self) {
        if let Some(follower) = &mut self.follower {
            follower.recorded(self.record.motion.last());
        }
    }

    /// The motion, with these warnings and its own.
    pub(super) fn into_motion(
        self,
        stepper: &L::Stepper<'m, M>,
        last: &L::State,
        warnings: impl Iterator<Item = Warning>,
    ) -> Motion<N, L> {
        let warnings = self.resolution.warning(last).into_iter().chain(warnings);
        self.record.into_motion(warnings, *M::statistics(stepper))
    }
}

/// The motion that is recorded, and the warnings about its nodes.
struct Record<const N: usize, L: Length<N>> {
    motion: Motion<N, L>,
    watch: Watch,
    /// The number of elements from one recorded node to the next.
    every: usize,
    /// Whether the model conserves energy.
    conserves: bool,
    /// Whether energy is conserved, by the model and since the last recorded node.
    is_conserved: bool,
}

impl<const N: usize, L: Length<N>> Record<N, L> {
    /// Whether the end of an element is recorded.
    fn is_due(&self, number: usize) -> bool {
        (number + 1).is_multiple_of(self.every)
    }

    /// Whether the last node is that of a time.
    fn is_at(&self, t: f64) -> bool {
        self.motion.last().t == t
    }

    /// Whether a node at an event is recorded already.
    fn has(&self, side: Side, (t, state): (f64, &L::State)) -> bool {
        match side {
            Side::Before => self.is_at(t),
            // Impulses at a node act after it, and may lead to an event there.
            Side::Last => self.is_at(t) && self.motion.last().state() == *state,
            Side::After => false,
        }
    }

    /// Compares the energy of the last node with that of the one before; `rounding` returns its rounding error for the
    /// time between them.
    fn check_energy(&mut self, rounding: &dyn Fn(&Node<N, L>, f64) -> f64) {
        let node = self.motion.last();
        let recorded = Recorded::last_of(&self.motion, self.is_conserved);
        self.watch.pass(recorded, &|time| rounding(node, time));
        self.is_conserved = self.conserves;
    }

    /// The motion with all warnings and the work of its steps.
    fn into_motion(
        mut self,
        warnings: impl Iterator<Item = Warning>,
        statistics: Statistics,
    ) -> Motion<N, L> {
        self.watch.add(warnings);
        self.motion.set_statistics(statistics);
        self.motion.set_warnings(self.watch.into_warnings());
        self.motion
    }
}

impl<'m, M, const N: usize, L> Follow<'m, M, N, L> for Recorder<'_, 'm, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn passed(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        passed: &Passed<'_, N, L>,
    ) -> Result<(), TransitionError> {
        match &mut self.follower {
            Some(follower) => follower.passed(stepper, passed),
            None => Ok(()),
        }
    }

    fn met(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        match &mut self.follower {
            Some(follower) => follower.met(severed),
            None => Ok(()),
        }
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        match &mut self.follower {
            Some(follower) => follower.cut(severed),
            None => Ok(()),
        }
    }

    fn acted(&mut self) {
        if let Some(follower) = &mut self.follower {
            follower.acted();
        }
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        match &mut self.follower {
            Some(follower) => follower.set(model),
            None => Ok(()),
        }
    }

    fn reached(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        t: f64,
        state: &L::State,
    ) -> ControlFlow<()> {
        match &mut self.follower {
            Some(follower) => follower.reached(stepper, t, state),
            None => ControlFlow::Continue(()),
        }
    }

    fn recorded(&mut self, node: &Node<N, L>) {
        if let Some(follower) = &mut self.follower {
            follower.recorded(node);
        }
    }
}

impl<'m, M, const N: usize, L> Observe<'m, M, N, L> for Recorder<'_, 'm, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn keeps(&self) -> bool {
        self.record.every == 1
    }

    fn whole(&mut self, stepper: &L::Stepper<'m, M>, passed: &Passed<'_, N, L>) {
        self.resolution.look(M::statistics(stepper), passed);
    }

    fn inside(&mut self, dense: L::Polynomial) {
        self.record.motion.keep_element(dense);
    }

    fn at_event(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        model: &M,
        side: Side,
        (t, state): (f64, &L::State),
    ) {
        self.record.is_conserved = false;
        if self.record.has(side, (t, state)) {
            return;
        }
        self.record(stepper, model, (t, state));
        if side == Side::After {
            self.record.motion.begin_arc(*M::statistics(stepper));
        }
        self.tell();
    }

    fn changed(&mut self, model: &Share<'m, M>, values: &[(usize, f64)]) {
        self.resolution.set_model(model.clone());
        let names = model.parameter_names();
        self.record.motion.set_parameters(&names, values);
    }
}
