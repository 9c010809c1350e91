//! M q̈ = f(q, q̇): forces are the only unknowns.

use super::group::{Group, Row, Work, load, replace};
use super::judge::{Increments, larger};
use super::pair::Eight;
use super::products::{apply, sum};
use super::step::Step;
use crate::model::{Form, Model};
use crate::points::end::moved_exactly;
use crate::points::sweep::{Largest, no_derivatives};

impl<M, const N: usize> Step<'_, M, N>
where
    M: Model<N>,
{
    /// Velocities at the start, and what low words add at the points.
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
                let mass = like.like(mass[a]);
                let v = momenta[a] / mass;
                let (product, rest) = v.product(mass);
                missing[a] += (momenta[a] - product) - rest;
                work.velocity[a] = v.lanes();
                work.velocity_low[a] = (missing[a] / mass).lanes();
            }
        } else {
            let v = self.inertia.times(like, &momenta);
            let low = self.inertia.times(like, &missing);
            for a in 0..N {
                (work.velocity[a], work.velocity_low[a]) = (v[a].lanes(), low[a].lanes());
            }
        }
        self.accelerate(like, &group.forces, &mut work.velocities);
        apply(
            like,
            &self.tables.twice_low,
            &work.velocities,
            &mut work.products,
        );
        if self.inertia.diagonal.is_some() && self.inertia.inverse_low != [0.0; N] {
            // What the one rounding of 1/m takes from all accelerations; nothing from those of unit masses.
            for (rest, force) in work.velocities.iter_mut().zip(&group.forces) {
                for a in 0..N {
                    let low = like.like(self.inertia.inverse_low[a]);
                    rest[a] = (low * like.with(force[a])).lanes();
                }
            }
            apply(
                like,
                &self.tables.twice,
                &work.velocities,
                &mut work.more_products,
            );
            for (sum, part) in work.products.iter_mut().zip(&work.more_products) {
                for a in 0..N {
                    sum[a] = (like.with(sum[a]) + like.with(part[a])).lanes();
                }
            }
        }
        let h = like.like(self.h);
        for l in 0..self.tables.points {
            let reach = like.like(self.tables.reach.as_flattened()[l]);
            let reach_low = like.like(self.tables.reach_low.as_flattened()[l]);
            for a in 0..N {
                let (v, v_low) = (like.with(work.velocity[a]), like.with(work.velocity_low[a]));
                let drift = reach * v_low + reach_low * v;
                let moved = h * (drift + h * like.with(work.products[l][a]));
                work.low_position[l][a] = (like.with(group.low.q[a]) + moved).lanes();
            }
        }
    }

    /// M⁻¹ f
    #[inline(always)]
    fn accelerate<V: Eight>(&self, like: V, forces: &[Row<N>], accelerations: &mut [Row<N>]) {
        for (acceleration, force) in accelerations.iter_mut().zip(forces) {
            let product = self.inertia.times(like, &load(like, force));
            for a in 0..N {
                acceleration[a] = product[a].lanes();
            }
        }
    }

    /// One iteration: coordinates from accelerations, forces at the coordinates.
    #[inline(always)]
    pub(super) fn sweep_second_order<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        mask: V::Mask,
    ) -> Increments<V> {
        self.accelerate(like, &group.forces, &mut work.velocities);
        apply(
            like,
            &self.tables.twice,
            &work.velocities,
            &mut work.products,
        );
        if M::FACTS.forced {
            let rates = match M::FORM {
                Form::Lagrangian => &work.velocities,
                Form::Hamiltonian => &group.forces,
            };
            apply(like, &self.tables.once, rates, &mut work.more_products);
        }
        let h = like.like(self.h);
        let start_q = load(like, &group.start.q);
        let start_v = load(like, &work.velocity);
        let start_z = match M::FORM {
            Form::Lagrangian => start_v,
            Form::Hamiltonian => load(like, &group.start.p),
        };
        let (mut changed, mut size) = (Largest::none(like), Largest::none(like));
        let zero = like.like(0.0);
        for l in 0..self.tables.points {
            let reach = like.like(self.tables.reach.as_flattened()[l]);
            let (mut q, mut z) = ([zero; N], [zero; N]);
            for a in 0..N {
                let moved = h * (reach * start_v[a] + h * like.with(work.products[l][a]));
                q[a] = start_q[a] + (moved + like.with(work.low_position[l][a]));
                if M::FACTS.forced {
                    z[a] = start_z[a] + h * like.with(work.more_products[l][a]);
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
                let inverse = like.like(self.inertia.inverse[a][a]);
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

    /// p₁ = p₀ + h Σ b f and q₁ = q₀ + h (v₀ + h Σ (bᵀA) M⁻¹ f) of coordinate `a`; [`prepare_end`](Self::prepare_end) goes before.
    #[inline(always)]
    pub(super) fn end_second_order<V: Eight>(
        &self,
        like: V,
        group: &Group<N>,
        work: &Work<N>,
        a: usize,
    ) -> ((V, V), (V, V)) {
        let h = like.like(self.h);
        let force = sum(like, &self.tables.weights, &group.forces, a);
        let lever = sum(like, &self.tables.lever, &work.velocities, a);
        let velocity = (like.with(work.velocity[a]), like.with(work.velocity_low[a]));
        let velocity = moved_exactly(h, lever, velocity);
        let q = (like.with(group.start.q[a]), like.with(group.low.q[a]));
        let p = (like.with(group.start.p[a]), like.with(group.low.p[a]));
        (moved_exactly(h, velocity, q), moved_exactly(h, force, p))
    }

    /// Accelerations at the end of the iteration.
    #[inline(always)]
    pub(super) fn prepare_end<V: Eight>(&self, like: V, group: &Group<N>, work: &mut Work<N>) {
        let Some(mass) = &self.inertia.diagonal else {
            self.accelerate(like, &group.forces, &mut work.velocities);
            return;
        };
        // Rounded for itself at every point, not with the one rounding of 1/m.
        for (acceleration, force) in work.velocities.iter_mut().zip(&group.forces) {
            for a in 0..N {
                acceleration[a] = (like.with(force[a]) / like.like(mass[a])).lanes();
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
