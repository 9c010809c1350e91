//! The rounding errors of functions whose sign is not known yet.

use super::Events;
use super::model::EventModel;
use crate::length::Length;

impl<const N: usize, L: Length<N>> Events<'_, N, L> {
    /// The rounding errors that the functions may have at the start of an element, if the sign of one is unknown: their
    /// changes with roundings of all numbers that they depend on, for some choices of their signs. Otherwise zeros.
    pub(super) fn roundings(
        &self,
        model: &dyn EventModel<N, L>,
        (t, state): (f64, &L::State),
    ) -> Vec<f64> {
        /// The rounding errors of numbers on a polynomial.
        const ROUNDING: f64 = 8.0 * f64::EPSILON;
        /// Differences of two numbers, and of sums of some, are changed by one of these choices at least.
        const CHOICES: [usize; 4] = [0, 1, 2, 3];
        let mut all = vec![0.0; self.watched.len()];
        if !self.seen.sides.contains(&0.0) {
            return all;
        }
        let (q, _) = L::parts(state);
        let velocity = match self.needs_velocity {
            true => model.velocity(t, state, &L::zero(q)),
            false => None,
        };
        let velocity = velocity.unwrap_or_else(|| L::zero(q));
        let exact = self.row(model, (t, state, &velocity));
        for choice in CHOICES {
            let changed = |number: usize, value: f64| {
                let is_negative = (number & choice).count_ones() % 2 == 1;
                value * (1.0 + if is_negative { -ROUNDING } else { ROUNDING })
            };
            let numbers = L::numbers(state).into_iter().enumerate();
            let numbers: Vec<f64> = numbers.map(|(k, value)| changed(k, value)).collect();
            let beside = L::state_of(state, &numbers);
            let v = L::from_fn(&velocity, |a| changed(a, velocity.as_ref()[a]));
            let moved = self.row(model, (t, &beside, &v));
            for (rounding, (moved, exact)) in all.iter_mut().zip(moved.iter().zip(&exact)) {
                let change = (moved - exact).abs();
                *rounding = if change.is_finite() {
                    *rounding + change
                } else {
                    0.0
                };
            }
        }
        all
    }
}
