//! Dense output of the last step.

use super::setup::Stepper;
use crate::dense::DenseElement;
use crate::error::StepError;
use crate::method::Memory;
use crate::model::Model;
use crate::points::reach::{Reach, Weights};
use crate::scheme::Tables;
use alloc::vec::Vec;

impl<M, const N: usize> Stepper<'_, M, N>
where
    M: Model<N>,
{
    /// The workspace of the last step, if that step did not fill the stepper's own one; `None` if it did.
    ///
    /// After a step with all points at once its root is copied, and no other root is searched for. A step by the
    /// propagator of a linear model is solved again; its equations have a single root.
    ///
    /// # Errors
    /// [`StepError`] if the step of a linear model cannot be solved.
    pub(super) fn retrace(&self) -> Result<Option<Vec<f64>>, StepError> {
        if !(Self::MAY_HAVE_POINTS || Self::MAY_BE_PROPAGATED) {
            return Ok(None);
        }
        let carried = &self.common.carried;
        let Some(last) = carried.memory.last.filter(|_| carried.skipped) else {
            return Ok(None);
        };
        let (mut numbers, mut pivots) = self.common.room();
        if Self::MAY_HAVE_POINTS {
            let kept = (carried.points.clone())
                .is_some_and(|mut points| points.write_back::<M>(&self.common.table, &mut numbers));
            debug_assert!(kept, "only steps with all points at once go past it");
            return if kept {
                Ok(Some(numbers))
            } else {
                Err(StepError::NonFinite)
            };
        }
        let mut state = last.start;
        let (mut memory, place) = (Memory::new(), (last.t, last.h));
        self.ordinary(&mut memory, (&mut numbers, &mut pivots), place, &mut state)?;
        Ok(Some(numbers))
    }

    /// A box that contains the polynomial of the last step, at much less cost than that polynomial. It is `None` for
    /// steps that were cut or not made by fixed-point iteration, for linear and constrained models, and for elements
    /// that are not Runge–Kutta methods.
    #[must_use]
    #[inline(always)]
    pub fn reach(&mut self) -> Option<Reach<N>> {
        let is_whole = self.common.carried.pieces.is_empty();
        if !(Self::MAY_HAVE_POINTS && self.common.is_of_points && is_whole) {
            return None;
        }
        if self.common.weights.is_none() {
            self.weigh();
        }
        let carried = &self.common.carried;
        let (points, last) = (carried.points.as_ref()?, carried.memory.last.as_ref()?);
        let weights = self.common.weights.as_ref()?;
        points.reach::<M>(weights, last.h, &last.start)
    }

    #[cold]
    fn weigh(&mut self) {
        self.common.weights = Some(Weights::of(&self.common.table.view()));
    }

    /// Prepares dense output of the last step, where [`ends_only`](Self::ends_only) has omitted it.
    pub fn look_inside(&mut self) {
        if self.common.carried.skipped && self.write_back() {
            self.common.carried.skipped = false;
        }
    }

    /// The polynomial of the last step, from time `start` to time `end`.
    ///
    /// Before the first step, and after a failed one, it is the constant zero. If the inside of a step by the
    /// propagator of a linear model cannot be recomputed, it is NaN between the ends.
    #[must_use]
    pub fn dense(&self, start: f64, end: f64) -> DenseElement<N> {
        self.dense_in(None, start, end)
    }

    /// The same, reusing the memory of an element that is no longer needed.
    #[must_use]
    pub fn dense_in(
        &self,
        spare: Option<DenseElement<N>>,
        start: f64,
        end: f64,
    ) -> DenseElement<N> {
        match self.common.carried.dense_of_pieces(start, end) {
            Some(dense) => dense,
            None => self.dense_of_last(spare, start, end),
        }
    }

    pub(super) fn dense_of_last(
        &self,
        spare: Option<DenseElement<N>>,
        start: f64,
        end: f64,
    ) -> DenseElement<N> {
        if const { !M::CONSTRAINTS.is_empty() } {
            return self.common.dense_with_constraints((start, end));
        }
        let retraced = self.retrace();
        let times = (start, end);
        self.common
            .dense_without_constraints(retraced, spare, times)
    }
}
