//! M q̈ = f(q, q̇): forces are the only unknowns.

use super::group::{Group, Row, Work, load, replace};
use super::judge::{Increments, larger};
use super::pair::Eight;
use super::products::{apply, sum};
use super::step::Step;
use crate::double_double::DoubleDouble;
use crate::model::{Form, Model};
use crate::points::end::moved;
use crate::points::sweep::{Largest, no_derivatives};

impl<M, const N: usize> Step<'_, M, N>
where
    M: Model<N>,
{
    /// Velocities at the start, and what they lost by rounding.
    #[inline(always)]
    pub(super) fn begin_second_order<V: Eight>(
        &self,
        like: V,
        group: &Group<N>,
        work: &mut Work<N>,
    ) {
        let momenta = load(like, &group.start.p);
        let mut missing = load(like, &group.low.p);
        if let Some(mass) = &self.inertia.diagonal {
            for a in 0..N {
                // The momentum belongs to no rounded velocity; the rest counts as low word.
                let inverse = like.like(self.inertia.inverse_diagonal[a]);
                let v = momenta[a] * inverse;
                let (product, rest) = v.product(like.like(mass[a]));
                missing[a] += (momenta[a] - product) - rest;
                work.velocity[a] = v.lanes();
                work.velocity_low[a] = (missing[a] * inverse).lanes();
            }
        } else {
            let v = self.inertia.times(like, &momenta);
            let low = self.inertia.times(like, &missing);
            for a in 0..N {
                (work.velocity[a], work.velocity_low[a]) = (v[a].lanes(), low[a].lanes());
            }
        }
    }

    /// How far the velocities at the start reach.
    #[inline(always)]
    fn set_drift<V: Eight>(&self, like: V, work: &mut Work<N>) {
        let h = like.like(self.h);
        for (drift, reach) in work.drift.iter_mut().zip(self.tables.reach.as_flattened()) {
            let reach = h * like.like(*reach);
            for a in 0..N {
                drift[a] = (reach * like.with(work.velocity[a])).lanes();
            }
        }
    }

    /// The same with what low words of states and tables add. The products are A² f.
    #[inline(always)]
    fn set_exact_drift<V: Eight>(&self, like: V, group: &Group<N>, work: &mut Work<N>) {
        let table = &self.tables.twice_low;
        apply(like, table, &group.forces, &mut work.more_products);
        let h = like.like(self.h);
        // What the one rounding of h² takes, the same in every step.
        let square_low = like.like(DoubleDouble::product(self.h, self.h).low);
        for l in 0..self.tables.points {
            let reach = like.like(self.tables.reach.as_flattened()[l]);
            let reach_low = like.like(self.tables.reach_low.as_flattened()[l]);
            let mut rate = self.accelerations(like, &work.more_products[l]);
            let whole = self.accelerations(like, &work.products[l]);
            for a in 0..N {
                if self.inertia.diagonal.is_some() {
                    // What the one rounding of 1/m takes from all accelerations.
                    let low = like.like(self.inertia.inverse_low[a]);
                    rate[a] += low * like.with(work.products[l][a]);
                }
                let (v, v_low) = (like.with(work.velocity[a]), like.with(work.velocity_low[a]));
                let v_low = reach * v_low + reach_low * v;
                let low = like.with(group.low.q[a]) + h * (v_low + h * rate[a]);
                let low = low + square_low * whole[a];
                work.drift[l][a] = (h * (reach * v) + low).lanes();
            }
        }
    }

    /// M⁻¹ f at a point.
    #[inline(always)]
    fn accelerations<V: Eight>(&self, like: V, forces: &Row<N>) -> [V; N] {
        self.inertia.times(like, &load(like, forces))
    }

    /// One iteration: coordinates from products with the forces, forces at the coordinates.
    #[inline(always)]
    pub(super) fn sweep_second_order<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        mask: V::Mask,
        iteration: u32,
    ) -> Increments<V> {
        let table = &self.tables.twice;
        apply(like, table, &group.forces, &mut work.products);
        if iteration == 0 {
            if self.control.is_rough() {
                self.set_drift(like, work);
            } else {
                self.set_exact_drift(like, group, work);
            }
        }
        if const { M::FACTS.forced } {
            let table = &self.tables.once;
            apply(like, table, &group.forces, &mut work.more_products);
        }
        let (h, square) = (like.like(self.h), like.like(self.h * self.h));
        let start_q = load(like, &group.start.q);
        let start_v = load(like, &work.velocity);
        let start_z = match M::FORM {
            Form::Lagrangian => start_v,
            Form::Hamiltonian => load(like, &group.start.p),
        };
        let (mut changed, mut size) = (Largest::none(like), Largest::none(like));
        let zero = like.like(0.0);
        for l in 0..self.tables.points {
            let (mut q, mut z) = ([zero; N], [zero; N]);
            let rate = self.accelerations(like, &work.products[l]);
            for a in 0..N {
                q[a] = start_q[a] + (like.with(work.drift[l][a]) + square * rate[a]);
            }
            if const { M::FACTS.forced } {
                let rate = match M::FORM {
                    Form::Lagrangian => self.accelerations(like, &work.more_products[l]),
                    Form::Hamiltonian => load(like, &work.more_products[l]),
                };
                for a in 0..N {
                    z[a] = start_z[a] + h * rate[a];
                }
            }
            let mut first = no_derivatives(like);
            let t = self.time(like, l);
            self.model.first_inline(t, &q, &z, &mut first);
            for a in 0..N {
                let force = match M::FORM {
                    Form::Lagrangian => first.q[a] + first.force[a],
                    Form::Hamiltonian => first.force[a] - first.q[a],
                };
                let old = &mut group.forces[l][a];
                // As accelerations: momenta of light and heavy bodies say nothing beside each other.
                let inverse = like.like(self.inertia.inverse_diagonal[a]);
                changed.raise(inverse * (force - like.with(*old)));
                size.raise(inverse * force);
                replace::<V>(mask, old, force);
            }
        }
        let (changed, size) = (changed.by_lane(), size.by_lane());
        let speed = largest(like, &start_v);
        let length = like.like(self.h.abs());
        let velocity = self.relative(speed, size, changed);
        let moved = speed + length * size;
        let position = self.relative(
            largest(like, &start_q),
            moved,
            like.like(0.5) * length * changed,
        );
        Increments {
            // Both are NaN, or none is.
            relative: larger(velocity, position),
            position,
        }
    }

    /// p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h M⁻¹ Σ (bᵀA) f) of coordinate `a`; [`prepare_end`](Self::prepare_end) goes before.
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
        let lever = if self.inertia.diagonal.is_some() {
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

    /// Accelerations at the end of the iteration, where each follows from several forces.
    #[inline(always)]
    pub(super) fn prepare_end<V: Eight>(&self, like: V, group: &Group<N>, work: &mut Work<N>) {
        if self.inertia.diagonal.is_some() {
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
        largest = larger(largest, vector[a].abs());
    }
    largest
}
