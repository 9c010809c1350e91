//! Keeps what a run passes as a motion, and notices what is doubtful about it.

use super::events::Severed;
use super::follow::{Follow, Passed};
use super::kind::Simulated;
use super::pieces::{Broken, Observe, Piece, Side};
use super::setup::Simulation;
use super::watch::resolution::{Examined, Resolution};
use super::watch::{Recorded, Watch};
use crate::error::RunErrorKind;
use crate::length::Length;
use crate::motion::{Motion, Node};
use std::ops::ControlFlow;
use tfe_runtime::Share;
use tfe_runtime::transition::TransitionError;

/// Keeps what a run passes, and shows it to a follower.
pub(super) struct Recorder<'m, M, F, const N: usize, L: Length<N>> {
    motion: Motion<N, L>,
    follower: F,
    watch: Watch,
    resolution: Option<Resolution<'m, M, N>>,
    record_every: usize,
    /// Whether the energy is kept, by the model and since the last recorded node.
    is_conserved: bool,
}

impl<'m, M, F, const N: usize, L> Recorder<'m, M, F, N, L>
where
    M: Simulated<N, L>,
    F: Follow<'m, M, N, L>,
    L: Length<N>,
{
    /// Goes on from the only node of `motion`.
    pub(super) fn new(
        simulation: &Simulation<'m, M, N, L>,
        motion: Motion<N, L>,
        mut follower: F,
    ) -> Self {
        follower.recorded(motion.last());
        let mut watch = Watch::new(simulation.chosen_element());
        watch.pass(Recorded::last_of(&motion, false));
        watch.add(simulation.model.weigh(motion.last()));
        Self {
            resolution: M::resolution(simulation.again()),
            motion,
            follower,
            watch,
            record_every: simulation.record_every,
            is_conserved: M::CONSERVES,
        }
    }

    /// Before an element.
    pub(super) fn begin(
        &mut self,
        model: &M,
        number: usize,
        at: (f64, f64),
        state: &L::State,
        has_impulses: bool,
    ) {
        model.look(&mut self.watch, number, at, state, false);
        self.is_conserved &= !has_impulses;
    }

    /// After an element that ends at `t`.
    pub(super) fn end(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        model: &M,
        (number, is_last): (usize, bool),
        (t, state): (f64, &L::State),
    ) {
        if !(is_last || (number + 1).is_multiple_of(self.record_every)) {
            return;
        }
        if self.motion.last().t != t {
            self.record(stepper, model, (t, state));
            self.follower.recorded(self.motion.last());
        }
        let recorded = Recorded::last_of(&self.motion, self.is_conserved);
        self.watch.pass(recorded);
        self.is_conserved = M::CONSERVES;
    }

    /// After an element that was not passed.
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
        model.look(&mut self.watch, number, (*t, *h), before, true);
        if self.motion.last().t != *t {
            self.record(stepper, model, (*t, before));
        }
    }

    fn record(&mut self, stepper: &mut L::Stepper<'m, M>, model: &M, at: (f64, &L::State)) {
        M::record(&mut self.motion, stepper, model, at);
    }

    pub(super) fn into_motion(
        mut self,
        stepper: &L::Stepper<'m, M>,
        last: &L::State,
    ) -> Motion<N, L> {
        self.watch.add(M::doubt(&self.resolution, last));
        self.motion.set_statistics(*M::statistics(stepper));
        self.motion.set_warnings(self.watch.into_warnings());
        self.motion
    }
}

impl<'m, M, F, const N: usize, L> Follow<'m, M, N, L> for Recorder<'m, M, F, N, L>
where
    M: Simulated<N, L>,
    F: Follow<'m, M, N, L>,
    L: Length<N>,
{
    fn passed(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        passed: &Passed<'_, N, L>,
    ) -> Result<(), TransitionError> {
        self.follower.passed(stepper, passed)
    }

    fn met(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        self.follower.met(severed)
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        self.follower.cut(severed)
    }

    fn acted(&mut self) {
        self.follower.acted();
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        self.follower.set(model)
    }

    fn reached(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        t: f64,
        state: &L::State,
    ) -> ControlFlow<()> {
        self.follower.reached(stepper, t, state)
    }

    fn recorded(&mut self, node: &Node<N, L>) {
        self.follower.recorded(node);
    }
}

impl<'m, M, F, const N: usize, L> Observe<'m, M, N, L> for Recorder<'m, M, F, N, L>
where
    M: Simulated<N, L>,
    F: Follow<'m, M, N, L>,
    L: Length<N>,
{
    fn keeps(&self) -> bool {
        self.record_every == 1
    }

    fn whole(&mut self, stepper: &L::Stepper<'m, M>, piece: &Piece<'_, N, L>) {
        if !piece.has_impulses {
            let examined = Examined {
                t: piece.start,
                h: piece.h,
                before: piece.before,
                after: piece.after,
            };
            M::examine(&mut self.resolution, M::statistics(stepper), examined);
        }
    }

    fn inside(&mut self, dense: L::Polynomial) {
        self.motion.keep_element(dense);
    }

    fn at_event(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        model: &M,
        side: Side,
        (t, state): (f64, &L::State),
    ) {
        self.is_conserved = false;
        if side == Side::Before && self.motion.last().t == t {
            return;
        }
        self.record(stepper, model, (t, state));
        if side == Side::After {
            self.motion.begin_arc(*M::statistics(stepper));
        }
        self.follower.recorded(self.motion.last());
    }

    fn changed(&mut self, model: &Share<'m, M>, values: &[(usize, f64)]) {
        M::exchange_in(&mut self.resolution, model.clone());
        let names = model.parameter_names();
        self.motion.set_parameters(&names, values);
    }
}
