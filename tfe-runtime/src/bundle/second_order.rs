//! The iteration for equations of second order, M q̈ = f(q, q̇): the unknowns are the forces.

use super::convergence::Increments;
use super::group::{Group, Row, Work, Written};
use super::products::{apply, sum};
use super::step::Step;
use crate::model::Model;
use crate::points::end::moved;
use crate::points::evaluation::Evaluation;
use crate::points::forms::acting;
use crate::points::second_order::velocity_of;
use crate::registers::pair::Eight;
use crate::registers::side::load;

impl<M, const N: usize> Step<'_, M, N>
where
    M: Model<N>,
{
    /// Computes the velocities at the start, and their rounding errors.
    #[inline(always)]
    pub(super) fn begin_second_order<V: Eight>(
        &self,
        like: V,
        group: &Group<N>,
        work: &mut Work<N>,
    ) {
        let momenta = load(like, &group.start.p);
        let missing = load(like, &group.low.p);
        if self.inertia.is_diagonal::<M>() {
            for a in 0..N {
                let inverse = like.like(self.inertia.inverse_diagonal[a]);
                let p = (momenta[a], missing[a]);
                let (v, v_low) = velocity_of(p, like.like(self.inertia.masses[a]), inverse);
                (work.velocity[a], work.velocity_low[a]) = (v.lanes(), v_low.lanes());
            }
        } else {
            let v = self.inertia.times::<M, _>(like, &momenta);
            let low = self.inertia.times::<M, _>(like, &missing);
            for a in 0..N {
                (work.velocity[a], work.velocity_low[a]) = (v[a].lanes(), low[a].lanes());
            }
        }
    }

    /// M⁻¹ f at a point.
    #[inline(always)]
    fn accelerations<V: Eight>(&self, like: V, forces: &Row<N>) -> [V; N] {
        self.inertia.times::<M, _>(like, &load(like, forces))
    }

    /// One iteration for the forces, after their products with the tables.
    #[inline(always)]
    pub(super) fn sweep_second_order<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        written: Written<V>,
        evaluation: &mut Evaluation<V, N>,
        iteration: u32,
    ) -> Increments<V> {
        let (table, acting) = (&self.tables.twice, &const { acting::<M, N>() });
        apply(like, table, acting, &group.forces, &mut work.products);
        if iteration == 0 {
            let (at, forces) = self.accelerated(group, work, written);
            if self.control.is_rough() {
                forces.set_drift::<_, _, M>(like, &at);
            } else {
                forces.set_exact_drift::<_, _, M>(like, &at);
            }
        }
        let (at, forces) = self.accelerated::<V>(group, work, written);
        let (changed, size) = forces.sweep(like, self.model, &at, evaluation);
        let (changed, size) = (changed.by_lane(), size.by_lane());
        let speed = largest(like, &load(like, &work.velocity));
        let distance = largest(like, &load(like, &group.start.q));
        // The relative changes of velocity and position.
        let length = like.like(self.h.abs());
        let half = like.like(0.5) * length;
        let velocity = (length * changed, speed.larger(length * size));
        let position = (
            length * (half * changed),
            distance.larger(length * (speed + length * size)),
        );
        Increments::larger_quotient(velocity, position, half)
    }

    /// p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h M⁻¹ Σ (bᵀA) f) for coordinate `a`; [`prepare_end`](Self::prepare_end)
    /// has to be called first.
    #[inline(always)]
    pub(super) fn end_second_order<V: Eight, const EXACT: bool>(
        &self,
        like: V,
        group: &Group<N>,
        work: &Work<N>,
        a: usize,
    ) -> ((V, V), (V, V)) {
        let h = like.like(self.h);
        let force = sum::<_, N, EXACT>(like, &self.tables.weights, &group.forces, a);
        let lever = &self.tables.lever;
        let lever = if self.inertia.is_diagonal::<M>() {
            let (sum, low) = sum::<_, N, EXACT>(like, lever, &group.forces, a);
            let inverse = like.like(self.inertia.inverse_diagonal[a]);
            let inverse_low = like.like(self.inertia.inverse_low[a]);
            let (product, rest) = inverse.product(sum);
            (product, rest + (inverse * low + inverse_low * sum))
        } else {
            sum::<_, N, EXACT>(like, lever, &work.velocities, a)
        };
        let velocity = (like.with(work.velocity[a]), like.with(work.velocity_low[a]));
        let velocity = moved::<_, EXACT>(h, lever, velocity);
        let q = (like.with(group.start.q[a]), like.with(group.low.q[a]));
        let p = (like.with(group.start.p[a]), like.with(group.low.p[a]));
        (
            moved::<_, EXACT>(h, velocity, q),
            moved::<_, EXACT>(h, force, p),
        )
    }

    /// Computes the accelerations at the end of the iteration, where each depends on several forces.
    #[inline(always)]
    pub(super) fn prepare_end<V: Eight>(&self, like: V, group: &Group<N>, work: &mut Work<N>) {
        if self.inertia.is_diagonal::<M>() {
            return;
        }
        for (acceleration, force) in work.velocities.iter_mut().zip(&group.forces) {
            let product = self.accelerations(like, force);
            for a in 0..N {
                acceleration[a] = product[a].lanes();
            }
        }
    }
}

/// The largest magnitude of a vector, for every lane.
#[inline(always)]
pub(super) fn largest<V: Eight, const N: usize>(like: V, vector: &[V; N]) -> V {
    let mut largest = like.like(0.0);
    for a in 0..N {
        largest = vector[a].abs().larger(largest);
    }
    largest
}
