//! Who goes along with a run.

use super::events::Severed;
use crate::motion::Node;
use tfe_runtime::step::Stepper;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Model, State};

/// An element that a run has passed.
pub(super) struct Passed<'a, const N: usize> {
    pub(super) start: f64,
    pub(super) before: &'a State<N>,
    pub(super) end: f64,
    pub(super) after: &'a State<N>,
}

/// Is shown what a run does.
pub(super) trait Follow<'m, M: Model<N>, const N: usize> {
    /// An element, to its end.
    fn passed(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        passed: &Passed<'_, N>,
    ) -> Result<(), TransitionError>;

    /// An element that an event has cut, up to there.
    fn cut(&mut self, _severed: &Severed<'_, '_, N>) -> Result<(), TransitionError> {
        Ok(())
    }

    /// After what was done at that event.
    fn acted(&mut self) {}

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

impl<'m, M, F, const N: usize> Follow<'m, M, N> for F
where
    M: Model<N>,
    F: FnMut(&mut Stepper<'m, M, N>, &Passed<'_, N>) -> Result<(), TransitionError>,
{
    fn passed(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        passed: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        self(stepper, passed)
    }
}
