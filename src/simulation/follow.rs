//! Who goes along with a run.

use super::events::Severed;
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
use crate::motion::Node;
use std::ops::ControlFlow;
use tfe_runtime::Share;
use tfe_runtime::transition::TransitionError;

/// An element that a run has passed.
pub struct Passed<'a, const N: usize, L: Length<N> = FixedLength> {
    pub(super) start: f64,
    /// Where it was begun: at its start, or beyond it by roundings where that is a break.
    pub(super) begin: f64,
    pub(super) h: f64,
    pub(super) before: &'a L::State,
    /// Where it ends, before impulses there.
    pub(super) after: &'a L::State,
}

/// Is shown what a run does.
pub trait Follow<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    /// An element, to its end.
    fn passed(
        &mut self,
        _stepper: &mut L::Stepper<'m, M>,
        _passed: &Passed<'_, N, L>,
    ) -> Result<(), TransitionError> {
        Ok(())
    }

    /// An event inside an element that goes on as if nothing had happened; before the element is passed or cut.
    fn met(&mut self, _severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        Ok(())
    }

    /// An element that an event has cut, up to there.
    fn cut(&mut self, _severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
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
        _stepper: &mut L::Stepper<'m, M>,
        _t: f64,
        _state: &L::State,
    ) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// A node that is recorded.
    fn recorded(&mut self, _node: &Node<N, L>) {}
}

/// Who goes along, if anybody does.
pub(super) type Follower<'f, 'm, M, const N: usize, L> = Option<&'f mut dyn Follow<'m, M, N, L>>;
