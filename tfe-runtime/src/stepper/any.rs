//! Steppers of any model: what is made of whole steps is compiled for a number of coordinates, not for every model.

use super::common::Common;
use crate::constrained::trail::Of;
use crate::cut::{Halving, in_halves, may_be_cut};
use crate::error::StepError;
use crate::method::Impulse;
use crate::model::State;
use alloc::vec::Vec;

/// A stepper of any model with N coordinates.
pub(super) trait AnyStepper<const N: usize>:
    Halving<State = State<N>, Kick = Impulse<N>, Kicks = Vec<Impulse<N>>>
{
    /// All of it but the model.
    fn common(&mut self) -> &mut Common<N>;

    /// The dimensions of the model.
    fn dimensions(&self) -> Of<'static>;
}

impl<const N: usize> dyn AnyStepper<N> + '_ {
    /// A step without a search for kinks.
    pub(super) fn advance_plainly(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        match self.whole(t, h, state, impulses) {
            Ok(()) => Ok(()),
            Err(error) => self.divide(error, (t, h), state, impulses),
        }
    }

    /// A step in halves, after the whole one has failed with `error`.
    ///
    /// # Errors
    /// The same error; `state` is unchanged then.
    #[cold]
    pub(super) fn divide(
        &mut self,
        error: StepError,
        (t, h): (f64, f64),
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        let common = self.common();
        let memory = &mut common.carried.memory;
        if !may_be_cut(&error, common.shape.linear, common.control.solve) {
            // The workspace may not hold the previous step.
            memory.last = None;
            return Err(error);
        }
        let (start, low, steps) = (*state, memory.low, memory.statistics.steps);
        let arrived = in_halves(self, (t, h), state, impulses, 1);
        let carried = &mut self.common().carried;
        carried.memory.statistics.steps = steps;
        if !arrived {
            (*state, carried.memory.low, carried.memory.last) = (start, low, None);
            carried.pieces.clear();
            return Err(error);
        }
        carried.memory.statistics.steps += 1;
        carried.memory.statistics.cuts += 1;
        Ok(())
    }
}
