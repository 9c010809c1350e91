//! Dense output of the last step.

use super::setup::Stepper;
use crate::dense::DenseElement;
use crate::error::StepError;
use crate::method::{Interval, Memory, may_be_phase};
use crate::model::{Model, State};
use crate::points::reach::{Reach, Weights};
use crate::scheme::Tables;
use crate::workspace::{interior_len, width};
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
        let Some(last) = self.carried.memory.last.filter(|_| self.carried.skipped) else {
            return Ok(None);
        };
        let (mut numbers, mut pivots) = self.room();
        if Self::MAY_HAVE_POINTS {
            let kept = (self.carried.points.clone())
                .is_some_and(|mut points| points.write_back::<M>(&self.table, &mut numbers));
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
        if !(Self::MAY_HAVE_POINTS && self.is_of_points && self.carried.pieces.is_empty()) {
            return None;
        }
        if self.weights.is_none() {
            self.weigh();
        }
        let (points, last) = (
            self.carried.points.as_ref()?,
            self.carried.memory.last.as_ref()?,
        );
        let weights = self.weights.as_ref()?;
        points.reach::<M>(weights, last.h, &last.start)
    }

    #[cold]
    fn weigh(&mut self) {
        self.weights = Some(Weights::of(&self.table.view()));
    }

    /// Prepares dense output of the last step, where [`ends_only`](Self::ends_only) has omitted it.
    pub fn look_inside(&mut self) {
        if self.carried.skipped && self.write_back() {
            self.carried.skipped = false;
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
        match self.carried.dense_of_pieces(start, end) {
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
        let scheme = self.table.view();
        let Some(last) = self.carried.memory.last else {
            return DenseElement::constant(start, end, State::ZERO);
        };
        let Ok(retraced) = self.retrace() else {
            return DenseElement::unknown(&scheme, (start, end), &last);
        };
        let numbers = retraced.as_ref().unwrap_or(&self.carried.numbers);
        let (times, interval) = (
            (start, end),
            Interval {
                start: last.t,
                length: last.h,
                impulses: &self.carried.impulses,
            },
        );
        if const { !M::CONSTRAINTS.is_empty() } {
            let m = interior_len(&scheme.element, M::FORM, N, M::CONSTRAINTS.len());
            let points = scheme.points() * N;
            let momenta = &numbers[3 * m + points..3 * m + 2 * points];
            let rates = &numbers[..scheme.unknowns() * N];
            let (rates, momenta) = (rates.as_chunks().0, momenta.as_chunks().0);
            // Constraints take up a part of impulses at the ends, which is distributed like their own impulses there.
            let (mut start, mut end) = (last.start, last.end);
            for impulse in interval.impulses {
                let tau = interval.node_or_place(impulse);
                let impulse = impulse.along(interval.length);
                for a in 0..N {
                    if tau == 0.0 {
                        start.p[a] += impulse[a];
                    } else if tau == 1.0 {
                        end.p[a] -= impulse[a];
                    }
                }
            }
            let ends = (&start, &end);
            let dense = DenseElement::constrained(&scheme, times, last.h, ends, rates, momenta);
            return dense.ending_in(last.end);
        }
        // The workspace begins with the unknowns, their start and the increments.
        let m = scheme.unknowns() * width(&scheme.element, M::FORM, N);
        let unknowns = numbers[..m].as_chunks().0;
        let (rates, forces) = if const { may_be_phase::<M, N>() } && scheme.element.has_phase_form()
        {
            let (pi, kappa) = unknowns.split_at(scheme.points());
            (kappa, pi)
        } else {
            (
                unknowns,
                numbers[3 * m..3 * m + scheme.points() * N].as_chunks().0,
            )
        };
        DenseElement::of(&scheme, times, &last, rates, forces, &interval, spare)
    }
}
