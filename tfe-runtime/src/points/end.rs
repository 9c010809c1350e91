//! The end of an element, in more than working precision where that is requested.

use super::{StepInput, Work};
use crate::model::{Model, State};
use crate::precise::Precise;
use crate::registers::four::{Four, block, put};
use crate::registers::storage::Storage;

impl<const N: usize, S: Storage> Work<N, S> {
    /// Start plus h times the integrals of the rates of first-order equations.
    #[inline(always)]
    pub(super) fn finish<V: Four, const EXACT: bool>(
        &self,
        like: V,
        input: &StepInput<'_, N, S>,
        (end, end_low): (&mut State<N>, &mut State<N>),
    ) {
        let (weights, h) = (&input.tables.weights, like.like(input.h));
        if const { matches!(N, 1 | 2) } {
            let forces = (weights, &*self.forces);
            let rates = weights.sums_beside::<_, N, EXACT>(like, &self.rates, forces);
            (*end, *end_low) = unpacked(moved::<_, EXACT>(h, rates, input.both(like)));
            return;
        }
        for at in (0..N).step_by(4) {
            let velocity = weights.sums::<_, N, EXACT>(like, &self.rates, at);
            let force = weights.sums::<_, N, EXACT>(like, &self.forces, at);
            let q = (
                block(like, &input.start.q, at),
                block(like, &input.low.q, at),
            );
            let p = (
                block(like, &input.start.p, at),
                block(like, &input.low.p, at),
            );
            let (q, q_low) = moved::<_, EXACT>(h, velocity, q);
            let (p, p_low) = moved::<_, EXACT>(h, force, p);
            put(q, &mut end.q, at);
            put(p, &mut end.p, at);
            put(q_low, &mut end_low.q, at);
            put(p_low, &mut end_low.p, at);
        }
    }

    /// p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h M⁻¹ Σ (bᵀA) f) of second-order equations.
    #[inline(always)]
    pub(super) fn finish_second_order<V: Four, M, const EXACT: bool>(
        &self,
        like: V,
        input: &StepInput<'_, N, S>,
        (end, end_low): (&mut State<N>, &mut State<N>),
    ) where
        M: Model<N>,
    {
        let (tables, h) = (input.tables, like.like(input.h));
        if const { matches!(N, 1 | 2) } {
            // Σ (bᵀA) f beside Σ b f; the contributions of the latter to the velocities are not needed here.
            let force = (&tables.weights, &*self.forces);
            let sums = (tables.lever).sums_beside::<_, N, EXACT>(like, &self.forces, force);
            let mut lever = sums;
            if !input.inertia.is_diagonal::<M>() {
                let (State { q, .. }, State { q: q_low, .. }) = unpacked(sums);
                let (high, low) = input.inertia.of_both(&q, &q_low);
                lever = (block(like, &high, 0), block(like, &low, 0));
            }
            let acceleration = self.accelerations::<_, M, EXACT>(like, input, lever, 0);
            let v = (
                block(like, &self.velocity, 0),
                block(like, &self.velocity_low, 0),
            );
            let velocity = moved::<_, EXACT>(h, acceleration, v);
            let rates = (
                first_of::<_, N>(velocity.0, sums.0),
                first_of::<_, N>(velocity.1, sums.1),
            );
            (*end, *end_low) = unpacked(moved::<_, EXACT>(h, rates, input.both(like)));
            return;
        }
        let (mut lever, mut lever_low) = ([0.0; N], [0.0; N]);
        let forces = &self.forces;
        for at in (0..N).step_by(4) {
            let (sum, low) = tables.lever.sums::<_, N, EXACT>(like, forces, at);
            put(sum, &mut lever, at);
            put(low, &mut lever_low, at);
        }
        if !input.inertia.is_diagonal::<M>() {
            (lever, lever_low) = input.inertia.of_both(&lever, &lever_low);
        }
        for at in (0..N).step_by(4) {
            let lever = (block(like, &lever, at), block(like, &lever_low, at));
            let acceleration = self.accelerations::<_, M, EXACT>(like, input, lever, at);
            let force = tables.weights.sums::<_, N, EXACT>(like, forces, at);
            let v = (
                block(like, &self.velocity, at),
                block(like, &self.velocity_low, at),
            );
            let q = (
                block(like, &input.start.q, at),
                block(like, &input.low.q, at),
            );
            let p = (
                block(like, &input.start.p, at),
                block(like, &input.low.p, at),
            );
            let (q, q_low) = moved::<_, EXACT>(h, moved::<_, EXACT>(h, acceleration, v), q);
            let (p, p_low) = moved::<_, EXACT>(h, force, p);
            put(q, &mut end.q, at);
            put(p, &mut end.p, at);
            put(q_low, &mut end_low.q, at);
            put(p_low, &mut end_low.p, at);
        }
    }

    /// Four accelerations from coordinate `at` on: forces already multiplied by an inverse mass matrix that is not
    /// diagonal, otherwise forces divided by masses.
    #[inline(always)]
    fn accelerations<V: Four, M, const EXACT: bool>(
        &self,
        like: V,
        input: &StepInput<'_, N, S>,
        forces: (V, V),
        at: usize,
    ) -> (V, V)
    where
        M: Model<N>,
    {
        let inertia = input.inertia;
        if !inertia.is_diagonal::<M>() {
            return forces;
        }
        let inverse = block(like, &inertia.inverse_diagonal, at);
        if const { !EXACT } {
            return (inverse * forces.0, forces.1);
        }
        // 1/m is used with its rounding error, which would otherwise be the same in every step.
        let (product, rest) = inverse.product(forces.0);
        let rest = block(like, &inertia.inverse_low, at).times_plus(forces.0, rest);
        (product, inverse.times_plus(forces.1, rest))
    }
}

impl<const N: usize, S: Storage> StepInput<'_, N, S> {
    /// The start and its rounding error, with coordinates beside momenta.
    #[inline(always)]
    fn both<V: Four>(&self, like: V) -> (V, V) {
        (
            beside(like, &self.start.q, &self.start.p),
            beside(like, &self.low.q, &self.low.p),
        )
    }
}

/// The values of one or two coordinates beside those of their momenta, as in
/// [`sums_beside`](crate::registers::storage::Weights::sums_beside).
#[inline(always)]
fn beside<V: Four, const N: usize>(like: V, q: &[f64; N], p: &[f64; N]) -> V {
    let mut lanes = [0.0; 4];
    for (lane, number) in lanes.iter_mut().enumerate() {
        let a = lane % (2 * N);
        *number = if a < N { q[a] } else { p[a - N] };
    }
    like.with(lanes)
}

/// The coordinates of one, and the momenta of another.
#[inline(always)]
fn first_of<V: Four, const N: usize>(one: V, other: V) -> V {
    let (coordinates, mut lanes) = (one.lanes(), other.lanes());
    for (lane, number) in lanes.iter_mut().enumerate() {
        if lane % (2 * N) < N {
            *number = coordinates[lane];
        }
    }
    one.with(lanes)
}

/// States from values that are side by side.
#[inline(always)]
fn unpacked<V: Four, const N: usize>((high, low): (V, V)) -> (State<N>, State<N>) {
    let (mut end, mut end_low) = (State::ZERO, State::ZERO);
    let (high, low) = (high.lanes(), low.lanes());
    for a in 0..N {
        (end.q[a], end.p[a]) = (high[a], high[N + a]);
        (end_low.q[a], end_low.p[a]) = (low[a], low[N + a]);
    }
    (end, end_low)
}

/// start + h · rate, in twice or in single working precision.
#[inline(always)]
pub(crate) fn moved<V: Precise, const EXACT: bool>(h: V, rate: (V, V), start: (V, V)) -> (V, V) {
    if const { EXACT } {
        moved_exactly(h, rate, start)
    } else {
        (h.times_plus(rate.0, start.0), h.like(0.0))
    }
}

/// start + h · rate, where each is a number with its rounding error.
#[inline(always)]
fn moved_exactly<V: Precise>(h: V, rate: (V, V), start: (V, V)) -> (V, V) {
    let (product, rest) = h.product(rate.0);
    let rest = h.times_plus(rate.1, rest) + start.1;
    let (sum, lost) = start.0.exact_sum(product);
    sum.exact_sum_with(lost + rest)
}
