//! The end of an element, to more than the working precision where that is asked for.

use super::{Leg, Work};
use crate::model::State;
use crate::precise::Precise;
use crate::registers::four::{Four, block, put};
use crate::registers::storage::Storage;

impl<const N: usize, S: Storage> Work<N, S> {
    /// Start plus h times the integrals of the rates of first-order equations.
    #[inline(always)]
    pub(super) fn finish<V: Four, const EXACT: bool>(
        &self,
        like: V,
        leg: &Leg<'_, N, S>,
    ) -> (State<N>, State<N>) {
        let (mut end, mut end_low) = (State::ZERO, State::ZERO);
        let (weights, h) = (&leg.tables.weights, like.like(leg.h));
        for at in (0..N).step_by(4) {
            let velocity = weights.sums::<_, N, EXACT>(like, &self.rates, at);
            let force = weights.sums::<_, N, EXACT>(like, &self.forces, at);
            let q = (block(like, &leg.start.q, at), block(like, &leg.low.q, at));
            let p = (block(like, &leg.start.p, at), block(like, &leg.low.p, at));
            let (q, q_low) = moved::<_, EXACT>(h, velocity, q);
            let (p, p_low) = moved::<_, EXACT>(h, force, p);
            put(q, &mut end.q, at);
            put(p, &mut end.p, at);
            put(q_low, &mut end_low.q, at);
            put(p_low, &mut end_low.p, at);
        }
        (end, end_low)
    }

    /// p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h M⁻¹ Σ (bᵀA) f) of second-order equations.
    #[inline(always)]
    pub(super) fn finish_second_order<V: Four, const EXACT: bool>(
        &self,
        like: V,
        leg: &Leg<'_, N, S>,
    ) -> (State<N>, State<N>) {
        let (mut end, mut end_low) = (State::ZERO, State::ZERO);
        let (mut lever, mut lever_low) = ([0.0; N], [0.0; N]);
        let (forces, h) = (&self.forces, like.like(leg.h));
        for at in (0..N).step_by(4) {
            let (sum, low) = leg.tables.lever.sums::<_, N, EXACT>(like, forces, at);
            put(sum, &mut lever, at);
            put(low, &mut lever_low, at);
        }
        if leg.inertia.diagonal.is_none() {
            (lever, lever_low) = leg.inertia.of_both(&lever, &lever_low);
        }
        for at in (0..N).step_by(4) {
            let mut acceleration = (block(like, &lever, at), block(like, &lever_low, at));
            if leg.inertia.diagonal.is_some() {
                // Times 1/m, which has a low word of its own: one rounding of it would be the same in every step.
                let inverse = block(like, &leg.inertia.inverse_diagonal, at);
                let inverse_low = block(like, &leg.inertia.inverse_low, at);
                if const { EXACT } {
                    let (product, rest) = inverse.product(acceleration.0);
                    let rest = inverse_low.times_plus(acceleration.0, rest);
                    let rest = inverse.times_plus(acceleration.1, rest);
                    acceleration = (product, rest);
                } else {
                    acceleration.0 = inverse * acceleration.0;
                }
            }
            let force = leg.tables.weights.sums::<_, N, EXACT>(like, forces, at);
            let v = (
                block(like, &self.velocity, at),
                block(like, &self.velocity_low, at),
            );
            let q = (block(like, &leg.start.q, at), block(like, &leg.low.q, at));
            let p = (block(like, &leg.start.p, at), block(like, &leg.low.p, at));
            let (q, q_low) = moved::<_, EXACT>(h, moved::<_, EXACT>(h, acceleration, v), q);
            let (p, p_low) = moved::<_, EXACT>(h, force, p);
            put(q, &mut end.q, at);
            put(p, &mut end.p, at);
            put(q_low, &mut end_low.q, at);
            put(p_low, &mut end_low.p, at);
        }
        (end, end_low)
    }
}

/// start + h · rate, to twice the precision or to the working one.
#[inline(always)]
pub(crate) fn moved<V: Precise, const EXACT: bool>(h: V, rate: (V, V), start: (V, V)) -> (V, V) {
    if const { EXACT } {
        moved_exactly(h, rate, start)
    } else {
        (h.times_plus(rate.0, start.0), h.like(0.0))
    }
}

/// start + h · rate, each a number and what rounding took from it.
#[inline(always)]
fn moved_exactly<V: Precise>(h: V, rate: (V, V), start: (V, V)) -> (V, V) {
    let (product, rest) = h.product(rate.0);
    let rest = h.times_plus(rate.1, rest) + start.1;
    let (sum, lost) = start.0.exact_sum(product);
    sum.exact_sum(lost + rest)
}
