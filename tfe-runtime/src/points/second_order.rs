//! M q̈ = f(q, q̇): forces are the only unknowns.

use super::sweep::{Evaluation, Magnitude, larger};
use super::{Leg, Work};
use crate::double_double::DoubleDouble;
use crate::equations::Increment;
use crate::model::{Form, Model};
use crate::registers::four::{Four, block, put};
use crate::registers::storage::Storage;

impl<const N: usize, S: Storage> Work<N, S> {
    /// Velocity at the start, and what it lost by rounding.
    #[inline(always)]
    pub(super) fn begin_second_order<V: Four>(&mut self, like: V, leg: &Leg<'_, N, S>) {
        let inertia = &leg.inertia;
        if let Some(mass) = &inertia.diagonal {
            for at in (0..N).step_by(4) {
                let p = block(like, &leg.start.p, at);
                let inverse = block(like, &inertia.inverse_diagonal, at);
                let v = p * inverse;
                // The momentum belongs to no rounded velocity; the rest counts as low word.
                let (product, rest) = v.product(block(like, mass, at));
                let missing = block(like, &leg.low.p, at) + ((p - product) - rest);
                put(v, &mut self.velocity, at);
                put(missing * inverse, &mut self.velocity_low, at);
            }
            return;
        }
        for (a, row) in inertia.inverse.iter().enumerate() {
            let (mut v, mut low) = (0.0, 0.0);
            for b in 0..N {
                v += row[b] * leg.start.p[b];
                low += row[b] * leg.low.p[b];
            }
            (self.velocity[a], self.velocity_low[a]) = (v, low);
        }
    }

    /// How far the velocity at the start reaches.
    #[inline(always)]
    pub(super) fn set_drift<V: Four>(&mut self, like: V, leg: &Leg<'_, N, S>) {
        let h = like.like(leg.h);
        for (drift, reach) in self.drift.iter_mut().zip(leg.tables.reach.iter()) {
            let reach = h * like.with(*reach);
            for a in 0..N {
                drift[a] = (reach * like.like(self.velocity[a])).lanes();
            }
        }
    }

    /// The same with what low words of state and tables add. The products are A² f, those with its low part follow here.
    #[inline(always)]
    pub(super) fn set_exact_drift<V: Four>(&mut self, like: V, leg: &Leg<'_, N, S>) {
        let products = &mut self.more_products;
        (leg.tables.twice_low).apply(like, &self.forces, products);
        let (groups, h) = (leg.tables.groups, like.like(leg.h));
        // What the one rounding of h² takes, the same in every step.
        let square_low = like.like(DoubleDouble::product(leg.h, leg.h).low);
        let drift = &mut self.drift[..groups];
        let products_low = &self.more_products[..groups];
        let products = &self.products[..groups];
        for c in 0..groups {
            let reach = like.with(leg.tables.reach[c]);
            let reach_low = like.with(leg.tables.reach_low[c]);
            for a in 0..N {
                let v = like.like(self.velocity[a]);
                let v_low = reach.times_plus(like.like(self.velocity_low[a]), reach_low * v);
                let mut rate = leg.inertia.row(like, &products_low[c], a);
                if leg.inertia.diagonal.is_some() {
                    // What the one rounding of 1/m takes from all accelerations.
                    let inverse_low = like.like(leg.inertia.inverse_low[a]);
                    rate = inverse_low.times_plus(like.with(products[c][a]), rate);
                }
                let low = h.times_plus(h.times_plus(rate, v_low), like.like(leg.low.q[a]));
                let low = square_low.times_plus(leg.inertia.row(like, &products[c], a), low);
                drift[c][a] = h.times_plus(reach * v, low).lanes();
            }
        }
    }

    /// A² f
    #[inline(always)]
    pub(super) fn integrate_twice<V: Four>(&mut self, like: V, leg: &Leg<'_, N, S>) {
        (leg.tables.twice).apply(like, &self.forces, &mut self.products);
    }

    /// One iteration: coordinates from products with the forces, forces at the coordinates.
    #[inline(always)]
    pub(super) fn sweep_second_order<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        leg: &Leg<'_, N, S>,
        at: &mut Evaluation<'_, V, N>,
    ) -> Increment
    where
        M: Model<N>,
    {
        if const { M::FACTS.forced } {
            (leg.tables.once).apply(like, &self.forces, &mut self.more_products);
        }
        let (h, square) = (like.like(leg.h), like.like(leg.h * leg.h));
        let (mut changed, mut size) = (Magnitude::none(like), Magnitude::none(like));
        let count = self.forces.len();
        let forces = &mut self.forces[..count];
        let products = &self.products[..count];
        let more_products = &self.more_products[..count];
        let drift = &self.drift[..count];
        let nodes = &leg.tables.nodes[..count];
        for c in 0..count {
            let Evaluation { q, z, first } = at;
            let (start, far) = (&leg.start.q, (&products[c], &drift[c]));
            if leg.inertia.diagonal.is_some() {
                (leg.inertia).positions::<V, true>(square, start, far, q);
            } else {
                (leg.inertia).positions::<V, false>(square, start, far, q);
            }
            if const { M::FACTS.forced } {
                for a in 0..N {
                    z[a] = match M::FORM {
                        Form::Lagrangian => {
                            let rate = leg.inertia.row(like, &more_products[c], a);
                            h.times_plus(rate, like.like(self.velocity[a]))
                        }
                        Form::Hamiltonian => {
                            let rate = like.with(more_products[c][a]);
                            h.times_plus(rate, like.like(leg.start.p[a]))
                        }
                    };
                }
            }
            let t = like.like(leg.t) + h * like.with(nodes[c]);
            V::first(model, t, q, z, first);
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
                // As accelerations: momenta of light and heavy bodies say nothing beside each other.
                let inverse = like.like(leg.inertia.inverse_diagonal[a]);
                changed.raise(inverse * (force - like.with(forces[c][a])));
                size.raise(inverse * force);
                forces[c][a] = force.lanes();
            }
        }
        let (changed, size) = (changed.get(), size.get());
        if changed == 0.0 {
            return Increment::NONE;
        }
        let h = leg.h.abs();
        let speed = larger(self.speed, h * size);
        let distance = larger(self.distance, h * (self.speed + h * size));
        let velocity = h * changed / speed;
        let position = h * (0.5 * h * changed) / distance;
        // Both are NaN, or none is.
        let relative = larger(velocity, position);
        Increment { relative, position }
    }
}
