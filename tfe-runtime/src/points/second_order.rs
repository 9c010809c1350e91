//! M q̈ = f(q, q̇): forces are the only unknowns.

use super::four::Four;
use super::sweep::{Largest, no_derivatives, relative};
use super::{Leg, Points};
use crate::double_double::DoubleDouble;
use crate::equations::Increment;
use crate::legendre::largest;
use crate::model::{Form, Model};

impl<const N: usize> Points<N> {
    /// Velocity at the start, and what low words add.
    #[inline(always)]
    pub(super) fn begin_second_order<V: Four>(&mut self, like: V, leg: &Leg<'_, N>) {
        let groups = self.tables.groups;
        let mut missing = leg.low.p;
        if let Some(mass) = &self.inertia.diagonal {
            for a in 0..N {
                // The momentum belongs to no rounded velocity; the rest counts as low word.
                let v = leg.start.p[a] / mass[a];
                let rest = DoubleDouble::product(v, mass[a]);
                missing[a] += DoubleDouble::new(leg.start.p[a]).minus(rest).high;
                self.velocity[a] = v;
                self.velocity_low[a] = missing[a] / mass[a];
            }
        } else {
            for (a, row) in self.inertia.inverse.iter().enumerate() {
                let (mut v, mut low) = (0.0, 0.0);
                for b in 0..N {
                    v += row[b] * leg.start.p[b];
                    low += row[b] * missing[b];
                }
                (self.velocity[a], self.velocity_low[a]) = (v, low);
            }
        }
        self.accelerate(like);
        self.tables
            .twice_low
            .apply(like, &self.momenta, &mut self.products);
        if self.inertia.diagonal.is_some() {
            // What the one rounding of 1/m takes from all accelerations.
            for a in 0..N {
                let rest = like.like(self.inertia.inverse_low[a]);
                for k in a * groups..(a + 1) * groups {
                    self.momenta[k] = (rest * like.with(self.forces[k])).lanes();
                }
            }
            self.tables
                .twice
                .apply(like, &self.momenta, &mut self.more_products);
            for (sum, part) in self.products.iter_mut().zip(&self.more_products) {
                *sum = (like.with(*sum) + like.with(*part)).lanes();
            }
        }
        let h = like.like(leg.h);
        for a in 0..N {
            let (low_q, low_v) = (like.like(leg.low.q[a]), like.like(self.velocity_low[a]));
            for c in 0..groups {
                let k = a * groups + c;
                let reach = like.with(self.tables.reach[c]);
                let reach_low = like.with(self.tables.reach_low[c]);
                let drift = reach * low_v + reach_low * like.like(self.velocity[a]);
                let moved = h * (drift + h * like.with(self.products[k]));
                self.low_position[k] = (low_q + moved).lanes();
            }
        }
    }

    /// M⁻¹ f
    #[inline(always)]
    pub(super) fn accelerate<V: Four>(&mut self, like: V) {
        let groups = self.tables.groups;
        for (a, row) in self.inertia.inverse.iter().enumerate() {
            if self.inertia.diagonal.is_some() {
                let inverse = like.like(row[a]);
                for k in a * groups..(a + 1) * groups {
                    self.momenta[k] = (inverse * like.with(self.forces[k])).lanes();
                }
                continue;
            }
            for c in 0..groups {
                let mut product = like.like(0.0);
                for b in 0..N {
                    product += like.like(row[b]) * like.with(self.forces[b * groups + c]);
                }
                self.momenta[a * groups + c] = product.lanes();
            }
        }
    }

    /// One iteration: coordinates from accelerations, forces at the coordinates.
    #[inline(always)]
    pub(super) fn sweep_second_order<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        leg: &Leg<'_, N>,
    ) -> Increment
    where
        M: Model<N>,
    {
        let groups = self.tables.groups;
        self.accelerate(like);
        self.tables
            .twice
            .apply(like, &self.momenta, &mut self.products);
        if M::FACTS.forced {
            let rates = match M::FORM {
                Form::Lagrangian => &self.momenta,
                Form::Hamiltonian => &self.forces,
            };
            self.tables.once.apply(like, rates, &mut self.more_products);
        }
        let h = like.like(leg.h);
        let (mut changed, mut size) = (Largest::none(like), Largest::none(like));
        let zero = like.like(0.0);
        for c in 0..groups {
            let reach = like.with(self.tables.reach[c]);
            let (mut q, mut z) = ([zero; N], [zero; N]);
            for a in 0..N {
                let k = a * groups + c;
                let v = like.like(self.velocity[a]);
                let moved = h * (reach * v + h * like.with(self.products[k]));
                q[a] = like.like(leg.start.q[a]) + (moved + like.with(self.low_position[k]));
                if M::FACTS.forced {
                    let start = match M::FORM {
                        Form::Lagrangian => v,
                        Form::Hamiltonian => like.like(leg.start.p[a]),
                    };
                    z[a] = start + h * like.with(self.more_products[k]);
                }
            }
            let t = like.like(leg.t) + h * like.with(self.tables.nodes[c]);
            let mut first = no_derivatives(like);
            V::first(model, t, &q, &z, &mut first);
            for a in 0..N {
                let k = a * groups + c;
                let force = match M::FORM {
                    Form::Lagrangian => first.q[a] + first.force[a],
                    Form::Hamiltonian => first.force[a] - first.q[a],
                };
                let step = force - like.with(self.forces[k]);
                self.forces[k] = force.lanes();
                // As accelerations: momenta of light and heavy bodies say nothing beside each other.
                let inverse = like.like(self.inertia.inverse[a][a]);
                changed.raise(inverse * step);
                size.raise(inverse * force);
            }
        }
        let (changed, size) = (changed.get(), size.get());
        let h = leg.h;
        let velocity = relative(h, largest(&self.velocity), size, changed);
        let moved = largest(&self.velocity) + h.abs() * size;
        let position = relative(h, largest(&leg.start.q), moved, 0.5 * h.abs() * changed);
        // Both are NaN, or none is.
        let relative = velocity.max(position);
        Increment { relative, position }
    }

    /// Velocities at the points, which the iteration itself does not need.
    pub(super) fn set_rates(&mut self, h: f64) {
        let groups = self.tables.groups;
        let like = crate::Lanes([0.0; 4]);
        self.accelerate(like);
        self.tables
            .once
            .apply(like, &self.momenta, &mut self.products);
        for a in 0..N {
            for k in a * groups..(a + 1) * groups {
                for lane in 0..4 {
                    self.rates[k][lane] = self.velocity[a] + h * self.products[k][lane];
                }
            }
        }
    }
}
