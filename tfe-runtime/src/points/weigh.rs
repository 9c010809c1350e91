//! The weights of increments in an iteration that has converged relative to the largest coordinate.

use super::forms::{is_phase, is_second_order};
use super::{StepInput, Work};
use crate::legendre::larger;
use crate::model::Model;
use crate::precise::Precise;
use crate::registers::storage::{Row, Storage};
use crate::unlike::{Declarations, weights};

/// Numbers of a coordinate in an element.
pub(crate) struct Sizing<V> {
    /// The velocity at the start, in equations of second order.
    pub(crate) velocity: V,
    pub(crate) q: V,
    pub(crate) p: V,
    /// 1/m, in equations of second order.
    pub(crate) inverse: V,
    /// The rates of momentum and coordinate, at one point or the largest ones.
    pub(crate) force: V,
    pub(crate) rate: V,
}

impl<V: Precise> Sizing<V> {
    /// The sizes to which increments of coordinate `a` and its momentum are compared in an element of length h: those of
    /// the coordinate and of the momentum in phase space, else twice that of the velocity.
    #[inline(always)]
    pub(crate) fn sizes<M, const N: usize>(self, h: V, a: usize) -> (V, V)
    where
        M: Model<N>,
    {
        let h = h.abs();
        if const { is_second_order::<M, N>() } {
            let velocity = self.velocity.abs();
            if M::IGNORABLE[a] {
                return (velocity, velocity);
            }
            let change = h * (self.inverse * self.force).abs();
            let size = velocity.larger(change);
            return (size, size);
        }
        let rate = self.rate.abs();
        if const { is_phase::<M, N>() } {
            let (position, momentum) = (h * rate, h * self.force.abs());
            return (self.q.abs().larger(position), self.p.abs().larger(momentum));
        }
        (rate, rate)
    }
}

impl<const N: usize, S: Storage> StepInput<'_, N, S> {
    /// Compares increments of small coordinates with these from now on; false where none is small beside the largest
    /// one.
    // Here and in what it calls there are no closures: they would be compiled for the instruction set of the crate. The
    // unknowns are passed to no function of its own, so that they may stay in registers.
    #[inline(always)]
    pub(super) fn weigh<M>(&mut self, work: &Work<N, S>, of: &Declarations<N>) -> bool
    where
        M: Model<N>,
    {
        let (rates, momenta) = self.sizes::<M, false>(work);
        // Momenta have sizes of their own in phase space only.
        let of_momentum = const { is_phase::<M, N>() } && of.may_be_small(&momenta);
        if !(of.may_be_small(&rates) || of_momentum) {
            return false;
        }
        let (rates, momenta) = self.sizes::<M, true>(work);
        let of_momentum = const { is_phase::<M, N>() } && of.is_small(&momenta);
        if !(of.is_small(&rates) || of_momentum) {
            return false;
        }
        let of_rates = weights::<M, N>(&rates, 0.0);
        let of_momenta = if const { is_phase::<M, N>() } {
            weights::<M, N>(&momenta, 0.0)
        } else {
            None
        };
        multiply(&mut self.factors, &of_rates);
        multiply(&mut self.force_factors, &of_momenta);
        of_rates.is_some() || of_momenta.is_some()
    }

    /// The sizes of all coordinates and of their momenta, from rates at the first point, or in the `WHOLE` element.
    #[inline(always)]
    fn sizes<M, const WHOLE: bool>(&self, work: &Work<N, S>) -> ([f64; N], [f64; N])
    where
        M: Model<N>,
    {
        let (mut rates, mut momenta) = ([0.0; N], [0.0; N]);
        for a in 0..N {
            let sizing = Sizing {
                velocity: work.velocity[a],
                q: self.start.q[a],
                p: self.start.p[a],
                inverse: self.inertia.inverse_diagonal[a],
                force: largest_of::<N, WHOLE>(&work.forces, a),
                rate: largest_of::<N, WHOLE>(&work.rates, a),
            };
            (rates[a], momenta[a]) = sizing.sizes::<M, N>(self.h, a);
        }
        (rates, momenta)
    }
}

/// The largest magnitude of a coordinate at all points, or that at the first one; zero if there is none.
#[inline(always)]
fn largest_of<const N: usize, const WHOLE: bool>(rows: &[Row<N>], a: usize) -> f64 {
    if const { !WHOLE } {
        return match rows.first() {
            Some(row) => row[a][0].abs(),
            None => 0.0,
        };
    }
    let mut largest = 0.0;
    for row in rows {
        for number in row[a] {
            largest = larger(largest, number.abs());
        }
    }
    largest
}

/// Multiplies factors by weights, if there are any.
#[inline(always)]
fn multiply<const N: usize>(factors: &mut [f64; N], weights: &Option<[f64; N]>) {
    if let Some(weights) = weights {
        for a in 0..N {
            factors[a] *= weights[a];
        }
    }
}
