//! Keeps what a run passes as a motion, and notices what is doubtful about it.

use super::checks::conserves_energy;
use super::events::Severed;
use super::follow::{Follow, Passed};
use super::pieces::{Broken, Observe, Piece, Side};
use super::setup::Simulation;
use super::watch::resolution::{Examined, Resolution};
use super::watch::{Recorded, Watch};
use crate::error::RunErrorKind;
use crate::motion::{Motion, Node};
use std::ops::ControlFlow;
use tfe_runtime::step::{DenseElement, Stepper};
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Model, Share, State};

/// Keeps what a run passes, and shows it to a follower.
pub(super) struct Recorder<'m, M, F, const N: usize> {
    motion: Motion<N>,
    follower: F,
    watch: Watch,
    resolution: Resolution<'m, M, N>,
    record_every: usize,
    /// Whether the energy is kept, by the model and since the last recorded node.
    conserves: bool,
    is_conserved: bool,
}

impl<'m, M, F, const N: usize> Recorder<'m, M, F, N>
where
    M: Model<N>,
    F: Follow<'m, M, N>,
{
    /// Goes on from the only node of `motion`.
    pub(super) fn new(
        simulation: &Simulation<'m, M, N>,
        motion: Motion<N>,
        start: &State<N>,
        mut follower: F,
    ) -> Self {
        follower.recorded(motion.last());
        let (model, element) = (&simulation.model, simulation.chosen_element());
        let mut watch = Watch::new(element);
        let conserves = const { conserves_energy::<M, N>() };
        watch.pass(Recorded::last_of(&motion, false));
        if let Some(velocity) = motion.velocities().last() {
            watch.weigh(&**model, motion.last().t, (&start.q, velocity));
        }
        Self {
            resolution: Resolution::new(simulation.again()),
            motion,
            follower,
            watch,
            record_every: simulation.record_every,
            conserves,
            is_conserved: conserves,
        }
    }

    /// Before an element.
    pub(super) fn begin(
        &mut self,
        model: &M,
        number: usize,
        (t, h): (f64, f64),
        state: &State<N>,
        has_impulses: bool,
    ) {
        self.watch.look(model, number, (t, h), state);
        self.is_conserved &= !has_impulses;
    }

    /// After an element that ends at `t`.
    pub(super) fn end(
        &mut self,
        model: &M,
        number: usize,
        is_last: bool,
        t: f64,
        state: &State<N>,
    ) {
        if !(is_last || (number + 1).is_multiple_of(self.record_every)) {
            return;
        }
        if self.motion.last().t != t {
            self.motion.record(model, t, state);
            self.follower.recorded(self.motion.last());
        }
        self.watch
            .pass(Recorded::last_of(&self.motion, self.is_conserved));
        self.is_conserved = self.conserves;
    }

    /// After an element that was not passed.
    pub(super) fn fail(&mut self, model: &M, number: usize, broken: &Broken<N>) {
        let Some((t, h, before)) = &broken.piece else {
            return;
        };
        self.watch.examine(model, number, (*t, *h), before);
        if self.motion.last().t != *t {
            self.motion.record(model, *t, before);
        }
    }

    pub(super) fn into_motion(mut self, stepper: &Stepper<'m, M, N>, last: &State<N>) -> Motion<N> {
        self.watch.add(self.resolution.warning(last));
        self.motion.set_statistics(*stepper.statistics());
        self.motion.set_warnings(self.watch.into_warnings());
        self.motion
    }
}

impl<'m, M, F, const N: usize> Follow<'m, M, N> for Recorder<'m, M, F, N>
where
    M: Model<N>,
    F: Follow<'m, M, N>,
{
    fn passed(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        passed: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        self.follower.passed(stepper, passed)
    }

    fn met(&mut self, severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        self.follower.met(severed)
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
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
        stepper: &mut Stepper<'m, M, N>,
        t: f64,
        state: &State<N>,
    ) -> ControlFlow<()> {
        self.follower.reached(stepper, t, state)
    }

    fn recorded(&mut self, node: &Node<N>) {
        self.follower.recorded(node);
    }
}

impl<'m, M, F, const N: usize> Observe<'m, M, N> for Recorder<'m, M, F, N>
where
    M: Model<N>,
    F: Follow<'m, M, N>,
{
    fn keeps(&self) -> bool {
        self.record_every == 1
    }

    fn whole(&mut self, stepper: &Stepper<'m, M, N>, piece: &Piece<'_, N>) {
        if !piece.has_impulses {
            let examined = Examined {
                t: piece.start,
                h: piece.h,
                before: piece.before,
                after: piece.after,
            };
            self.resolution.look(stepper.statistics(), examined);
        }
    }

    fn inside(&mut self, dense: DenseElement<N>) {
        self.motion.keep_element(dense);
    }

    fn at_event(&mut self, stepper: &Stepper<'m, M, N>, side: Side, t: f64, state: &State<N>) {
        self.is_conserved = false;
        if side == Side::Before && self.motion.last().t == t {
            return;
        }
        self.motion.record(stepper.model(), t, state);
        if side == Side::After {
            self.motion.begin_arc(*stepper.statistics());
        }
        self.follower.recorded(self.motion.last());
    }

    fn changed(&mut self, model: &Share<'m, M>, values: &[(usize, f64)]) {
        self.resolution.set_model(model.clone());
        self.motion.set_parameters(&**model, values);
    }
}
