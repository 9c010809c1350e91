//! Who goes along with a run.

use super::events::Severed;
use crate::error::RunErrorKind;
use crate::motion::Node;
use std::ops::ControlFlow;
use tfe_runtime::step::Stepper;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Model, Share, State};

/// Where an element begins that a run has passed.
pub(super) struct Passed<'a, const N: usize> {
    pub(super) start: f64,
    pub(super) before: &'a State<N>,
}

/// Is shown what a run does.
pub(super) trait Follow<'m, M: Model<N>, const N: usize> {
    /// An element, to its end.
    fn passed(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        passed: &Passed<'_, N>,
    ) -> Result<(), TransitionError>;

    /// An event inside an element that goes on as if nothing had happened; before the element is passed or cut.
    fn met(&mut self, _severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        Ok(())
    }

    /// An element that an event has cut, up to there.
    fn cut(&mut self, _severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        Ok(())
    }

    /// After what was done at that event.
    fn acted(&mut self) {}

    /// Parameters that were set at that event: the model with them.
    fn set(&mut self, _model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        Ok(())
    }

    /// The end of an element of the grid, in whatever pieces; whether the run goes on.
    fn reached(
        &mut self,
        _stepper: &mut Stepper<'m, M, N>,
        _t: f64,
        _state: &State<N>,
    ) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// A node that is recorded.
    fn recorded(&mut self, _node: &Node<N>) {}
}

/// Nobody goes along.
pub(super) struct Nobody;

impl<'m, M: Model<N>, const N: usize> Follow<'m, M, N> for Nobody {
    fn passed(
        &mut self,
        _: &mut Stepper<'m, M, N>,
        _: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        Ok(())
    }
}

impl<'m, M, F, const N: usize> Follow<'m, M, N> for &mut F
where
    M: Model<N>,
    F: Follow<'m, M, N>,
{
    fn passed(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        passed: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        (**self).passed(stepper, passed)
    }

    fn met(&mut self, severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        (**self).met(severed)
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        (**self).cut(severed)
    }

    fn acted(&mut self) {
        (**self).acted();
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        (**self).set(model)
    }

    fn reached(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        t: f64,
        state: &State<N>,
    ) -> ControlFlow<()> {
        (**self).reached(stepper, t, state)
    }

    fn recorded(&mut self, node: &Node<N>) {
        (**self).recorded(node);
    }
}
