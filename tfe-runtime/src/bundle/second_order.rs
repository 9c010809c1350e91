//! M q̈ = f(q, q̇): forces are the only unknowns.

use super::group::{Group, Row, Work, load, replace};
use super::judge::Increments;
use super::products::{apply, sum};
use super::step::Step;
use crate::double_double::DoubleDouble;
use crate::model::{Form, Model};
use crate::points::end::moved;
use crate::points::sweep::no_derivatives;
use crate::registers::pair::Eight;

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
        let (h, square) = (like.like(self.h), like.like(self.h * self.h));
        // What the one rounding of h² takes, the same in every step.
        let square_low = like.like(DoubleDouble::product(self.h, self.h).low);
        let points = self.tables.points;
        let drift = &mut work.drift[..points];
        let products = &work.products[..points];
        let more_products = &work.more_products[..points];
        let reach = &self.tables.reach.as_flattened()[..points];
        let reach_low = &self.tables.reach_low.as_flattened()[..points];
        for l in 0..points {
            let mut low = [like; N];
            if self.inertia.diagonal.is_some() {
                for a in 0..N {
                    let by_square = like.like(self.reach_low[a]) * like.with(products[l][a]);
                    let more = like.with(more_products[l][a]);
                    low[a] = like.like(self.reach[a]).times_plus(more, by_square);
                }
            } else {
                let rate_low = self.accelerations(like, &more_products[l]);
                let rate = self.accelerations(like, &products[l]);
                for a in 0..N {
                    low[a] = square.times_plus(rate_low[a], square_low * rate[a]);
                }
            }
            let (reach, reach_low) = (like.like(reach[l]), like.like(reach_low[l]));
            for a in 0..N {
                let (v, v_low) = (like.with(work.velocity[a]), like.with(work.velocity_low[a]));
                let v_low = reach.times_plus(v_low, reach_low * v);
                let low = like.with(group.low.q[a]) + h.times_plus(v_low, low[a]);
                drift[l][a] = h.times_plus(reach * v, low).lanes();
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
        let zero = like.like(0.0);
        let (mut changed, mut size, mut sum) = ([zero; N], [zero; N], zero);
        let points = self.tables.points;
        let forces = &mut group.forces[..points];
        let drift = &work.drift[..points];
        let products = &work.products[..points];
        let more_products = &work.more_products[..points];
        let nodes = &self.tables.nodes.as_flattened()[..points];
        let mut first = no_derivatives(like);
        for l in 0..points {
            let (mut q, mut z) = (load(like, &drift[l]), [zero; N]);
            if self.inertia.diagonal.is_some() {
                for a in 0..N {
                    let reach = like.like(self.reach[a]);
                    q[a] = reach.times_plus(like.with(products[l][a]), q[a]);
                }
            } else {
                let rate = self.accelerations(like, &products[l]);
                for a in 0..N {
                    q[a] = square.times_plus(rate[a], q[a]);
                }
            }
            for a in 0..N {
                q[a] = start_q[a] + q[a];
            }
            if const { M::FACTS.forced } {
                let rate = match M::FORM {
                    Form::Lagrangian => self.accelerations(like, &more_products[l]),
                    Form::Hamiltonian => load(like, &more_products[l]),
                };
                for a in 0..N {
                    z[a] = h.times_plus(rate[a], start_z[a]);
                }
            }
            let t = like.like(self.t + self.h * nodes[l]);
            self.model.first_inline(t, &q, &z, &mut first);
            for a in 0..N {
                let given = match M::FORM {
                    Form::Lagrangian => first.q[a],
                    Form::Hamiltonian => -first.q[a],
                };
                let force = if const { M::FACTS.forced } {
                    given + first.force[a]
                } else {
                    given
                };
                let change = force - like.with(forces[l][a]);
                changed[a] = change.abs().larger(changed[a]);
                size[a] = force.abs().larger(size[a]);
                // A sum shows what is no number.
                sum += change;
                replace::<V>(mask, &mut forces[l][a], force);
            }
        }
        // As accelerations: momenta of light and heavy bodies say nothing beside each other.
        for a in 0..N {
            let inverse = like.like(self.inertia.inverse_diagonal[a].abs());
            (changed[a], size[a]) = (inverse * changed[a], inverse * size[a]);
        }
        let changed = largest(like, &changed) + zero * sum;
        let size = largest(like, &size);
        let (speed, distance) = (largest(like, &start_v), largest(like, &start_q));
        // Relative changes of velocity and position.
        let length = like.like(self.h.abs());
        let half = like.like(0.5) * length;
        let velocity = (length * changed, speed.larger(length * size));
        let position = (
            length * (half * changed),
            distance.larger(length * (speed + length * size)),
        );
        Increments::larger_quotient(velocity, position, half)
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
        largest = vector[a].abs().larger(largest);
    }
    largest
}
