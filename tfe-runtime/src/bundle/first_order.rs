//! Equations of first order: velocities are the unknowns, or the rates of phase space.

use super::group::{Group, Row, Work, load, replace};
use super::judge::{Increments, larger};
use super::products::{apply, sum};
use super::second_order::largest;
use super::step::Step;
use crate::model::Model;
use crate::points::end::moved;
use crate::points::sweep::{Largest, factor, no_derivatives};
use crate::registers::pair::Eight;

impl<M, const N: usize> Step<'_, M, N>
where
    M: Model<N>,
{
    /// What low words of the start and of the tables add at the points.
    #[inline(always)]
    pub(super) fn begin<V: Eight>(&self, like: V, group: &Group<N>, work: &mut Work<N>) {
        let table = &self.tables.once_low;
        let of_rates = match self.tables.projected.first() {
            None => table,
            Some(projection) => &projection.position_low,
        };
        apply(like, of_rates, &group.rates, &mut work.products);
        apply(like, table, &group.forces, &mut work.more_products);
        let (h, points) = (like.like(self.h), self.tables.points);
        let products = &work.products[..points];
        let more_products = &work.more_products[..points];
        let low_position = &mut work.low_position[..points];
        let low_momentum = &mut work.low_momentum[..points];
        for l in 0..points {
            for a in 0..N {
                let low = like.with(group.low.q[a]);
                low_position[l][a] = h.times_plus(like.with(products[l][a]), low).lanes();
                let low = like.with(group.low.p[a]);
                low_momentum[l][a] = h.times_plus(like.with(more_products[l][a]), low).lanes();
            }
        }
    }

    /// A Lagrangian: momenta and forces at the velocities, then velocities that belong to the momenta asked for.
    #[inline(always)]
    pub(super) fn sweep_velocity<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        mask: V::Mask,
        refresh: bool,
    ) -> Increments<V> {
        let (h, zero) = (like.like(self.h), like.like(0.0));
        let (start_q, start_p) = (load(like, &group.start.q), load(like, &group.start.p));
        let points = self.tables.points;
        let rates = &mut group.rates[..points];
        let forces = &mut group.forces[..points];
        let momenta = &mut work.momenta[..points];
        let products = &mut work.products[..points];
        let more_products = &mut work.more_products[..points];
        let low_position = &work.low_position[..points];
        let low_momentum = &work.low_momentum[..points];
        let nodes = &self.tables.nodes.as_flattened()[..points];
        let projection = self.tables.projected.first();
        let to_positions = match projection {
            None => &self.tables.once,
            Some(projection) => &projection.position,
        };
        apply(like, to_positions, rates, products);
        let mut first = no_derivatives(like);
        for l in 0..points {
            let mut q = start_q;
            for a in 0..N {
                let low = like.with(low_position[l][a]);
                q[a] += h.times_plus(like.with(products[l][a]), low);
            }
            let v = load(like, &rates[l]);
            let t = like.like(self.t + self.h * nodes[l]);
            if const { !M::FACTS.constant_mass } && refresh {
                let mut mass = [[zero; N]; N];
                (self.model).first_and_mass_inline(t, &q, &v, &mut first, &mut mass);
                factor(like, &mut mass);
                store(&mut work.masses[l], &mass);
            } else {
                self.model.first_inline(t, &q, &v, &mut first);
            }
            for a in 0..N {
                momenta[l][a] = (first.z[a] - start_p[a]).lanes();
                replace::<V>(mask, &mut forces[l][a], first.q[a] + first.force[a]);
            }
        }
        if let Some(projection) = projection {
            more_products.copy_from_slice(momenta);
            apply(like, &projection.onto_rates, more_products, momenta);
        }
        apply(like, &self.tables.once, forces, products);
        let (mut changed, mut size) = (Largest::none(like), Largest::none(like));
        for l in 0..points {
            let mut step = [zero; N];
            for a in 0..N {
                let low = like.with(low_momentum[l][a]);
                let wanted = h.times_plus(like.with(products[l][a]), low);
                step[a] = wanted - like.with(momenta[l][a]);
            }
            if const { M::FACTS.constant_mass } {
                step = self.inertia.times(like, &step);
            } else {
                solve(like, &work.masses[l], &mut step);
            }
            for a in 0..N {
                more_products[l][a] = step[a].lanes();
            }
        }
        let steps = match projection {
            None => more_products,
            Some(projection) => {
                // With one mass matrix for all points these would lie among the rates already.
                apply(like, &projection.onto_rates, more_products, products);
                products
            }
        };
        for l in 0..points {
            for a in 0..N {
                let (old, step) = (&mut rates[l][a], like.with(steps[l][a]));
                let rate = like.with(*old) + step;
                changed.raise(step);
                // What is not finite shows in the change.
                size.raise_finite(rate);
                replace::<V>(mask, old, rate);
            }
        }
        let (changed, size) = (changed.by_lane(), size.by_lane());
        let position = self.relative(largest(like, &start_q), size, changed);
        // The momentum at the end is as good as the velocities, whatever the step; what is left of an increment reaches it through forces
        // only, hence the factor.
        let velocity = changed / larger(size, like.like(f64::MIN_POSITIVE));
        let velocity = like.like(0.25) * velocity;
        Increments::new(larger(velocity, position), position)
    }

    /// A Hamiltonian: momenta, the velocities that belong to them, coordinates, and then both rates anew.
    #[inline(always)]
    pub(super) fn sweep_phase<V: Eight>(
        &self,
        like: V,
        group: &mut Group<N>,
        work: &mut Work<N>,
        mask: V::Mask,
        (is_first, refresh): (bool, bool),
    ) -> Increments<V> {
        let (h, zero) = (like.like(self.h), like.like(0.0));
        let (start_q, start_p) = (load(like, &group.start.q), load(like, &group.start.p));
        let points = self.tables.points;
        let rates = &mut group.rates[..points];
        let forces = &mut group.forces[..points];
        let momenta = &mut work.momenta[..points];
        let velocities = &mut work.velocities[..points];
        let products = &mut work.products[..points];
        let low_position = &work.low_position[..points];
        let low_momentum = &work.low_momentum[..points];
        let nodes = &self.tables.nodes.as_flattened()[..points];
        apply(like, &self.tables.once, forces, products);
        for l in 0..points {
            let mut change = [zero; N];
            for a in 0..N {
                let low = like.with(low_momentum[l][a]);
                let p = start_p[a] + h.times_plus(like.with(products[l][a]), low);
                change[a] = p - like.with(momenta[l][a]);
                momenta[l][a] = p.lanes();
            }
            let mut by_change = [zero; N];
            if !is_first && M::FACTS.constant_mass {
                by_change = self.inertia.times(like, &change);
            } else if !is_first {
                let mass = &work.masses[l];
                for a in 0..N {
                    for b in 0..N {
                        by_change[a] = like.with(mass[a][b]).times_plus(change[b], by_change[a]);
                    }
                }
            }
            for a in 0..N {
                velocities[l][a] = (like.with(rates[l][a]) + by_change[a]).lanes();
            }
        }
        apply(like, &self.tables.once, velocities, products);
        let none = Largest::none(like);
        let (mut force_changed, mut force_size) = (none, none);
        let (mut rate_changed, mut rate_size) = (none, none);
        let mut first = no_derivatives(like);
        for l in 0..points {
            let mut q = start_q;
            for a in 0..N {
                let low = like.with(low_position[l][a]);
                q[a] += h.times_plus(like.with(products[l][a]), low);
            }
            let p = load(like, &momenta[l]);
            let t = like.like(self.t + self.h * nodes[l]);
            if const { !M::FACTS.constant_mass } && refresh {
                let mut mass = [[zero; N]; N];
                (self.model).first_and_mass_inline(t, &q, &p, &mut first, &mut mass);
                store(&mut work.masses[l], &mass);
            } else {
                self.model.first_inline(t, &q, &p, &mut first);
            }
            for a in 0..N {
                let (old_force, old_rate) = (&mut forces[l][a], &mut rates[l][a]);
                let force = first.force[a] - first.q[a];
                force_changed.raise(force - like.with(*old_force));
                rate_changed.raise(first.z[a] - like.with(*old_rate));
                // What is not finite shows in the changes.
                force_size.raise_finite(force);
                rate_size.raise_finite(first.z[a]);
                replace::<V>(mask, old_force, force);
                replace::<V>(mask, old_rate, first.z[a]);
            }
        }
        let position = self.relative(
            largest(like, &start_q),
            rate_size.by_lane(),
            rate_changed.by_lane(),
        );
        let momentum = self.relative(
            largest(like, &start_p),
            force_size.by_lane(),
            force_changed.by_lane(),
        );
        // A NaN in one of them must not be lost.
        let relative = larger(position, momentum) + like.like(0.0) * (position + momentum);
        Increments::new(relative, position)
    }

    /// Start plus h times the integrals of the rates, of coordinate `a`.
    #[inline(always)]
    pub(super) fn end<V: Eight, const EXACT: bool>(
        &self,
        like: V,
        group: &Group<N>,
        a: usize,
    ) -> ((V, V), (V, V)) {
        let h = like.like(self.h);
        let velocity = sum::<_, N, EXACT>(like, &self.tables.weights, &group.rates, a);
        let force = sum::<_, N, EXACT>(like, &self.tables.weights, &group.forces, a);
        let q = (like.with(group.start.q[a]), like.with(group.low.q[a]));
        let p = (like.with(group.start.p[a]), like.with(group.low.p[a]));
        (
            moved::<_, EXACT>(h, velocity, q),
            moved::<_, EXACT>(h, force, p),
        )
    }
}

#[inline(always)]
fn store<V: Eight, const N: usize>(to: &mut [Row<N>; N], matrix: &[[V; N]; N]) {
    for a in 0..N {
        for b in 0..N {
            to[a][b] = matrix[a][b].lanes();
        }
    }
}

/// Solves with what [`factor`] has made.
#[inline(always)]
fn solve<V: Eight, const N: usize>(like: V, factors: &[Row<N>; N], vector: &mut [V; N]) {
    for row in 0..N {
        for j in 0..row {
            vector[row] = (-like.with(factors[row][j])).times_plus(vector[j], vector[row]);
        }
    }
    for row in (0..N).rev() {
        for j in row + 1..N {
            vector[row] = (-like.with(factors[row][j])).times_plus(vector[j], vector[row]);
        }
        vector[row] = vector[row] * like.with(factors[row][row]);
    }
}
