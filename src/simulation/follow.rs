//! Followers: observers that are called along a run.

use super::events::Severed;
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
use crate::motion::Node;
use std::ops::ControlFlow;
use tfe_runtime::Share;
use tfe_runtime::transition::TransitionError;

/// An element that a run has passed, or a piece of one that events have cut.
pub struct Passed<'a, const N: usize, L: Length<N> = FixedLength> {
    pub(super) t: f64,
    /// The start from which the times of points are counted: a few ulps beside it if a break is at an end.
    pub(super) begin: f64,
    pub(super) h: f64,
    pub(super) before: &'a L::State,
    /// The state at the end, before impulses there.
    pub(super) after: &'a L::State,
    pub(super) has_impulses: bool,
}

/// An observer of a run.
pub trait Follow<'m, M: 'm, const N: usize, L: Length<N> = FixedLength> {
    /// Called after an element that was passed to its end.
    fn passed(
        &mut self,
        _stepper: &mut L::Stepper<'m, M>,
        _passed: &Passed<'_, N, L>,
    ) -> Result<(), TransitionError> {
        Ok(())
    }

    /// Called at an event that only records, before its element is passed or cut.
    fn met(&mut self, _severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        Ok(())
    }

    /// Called at an event that cuts an element, with the part up to the event.
    fn cut(&mut self, _severed: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        Ok(())
    }

    /// Called after the action at that event.
    fn acted(&mut self) {}

    /// Called with the model whose parameters were set at that event.
    fn set(&mut self, _model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        Ok(())
    }

    /// Called at the end of an element of the grid, also if events have cut it; the result says whether the run
    /// continues.
    fn reached(
        &mut self,
        _stepper: &mut L::Stepper<'m, M>,
        _t: f64,
        _state: &L::State,
    ) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called with each recorded node.
    fn recorded(&mut self, _node: &Node<N, L>) {}
}

/// A follower, if there is one.
pub(super) type Follower<'f, 'm, M, const N: usize, L> = Option<&'f mut dyn Follow<'m, M, N, L>>;
