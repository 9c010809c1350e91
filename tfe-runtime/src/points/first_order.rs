//! The iteration for equations of first order, whose unknowns are velocities or the rates of phase space: one text for
//! four points of a trajectory side by side and for eight trajectories.

use super::arrangement::{Arrangement, Magnitude, Row};
use super::evaluation::Evaluation;
use super::forms::acting;
use crate::model::Model;
use crate::registers::side::{Side, factor, solve, store};

/// The unknowns and the working memory of their iteration, a row for each point or each group of points.
pub(crate) struct Rows<'a, const L: usize, const N: usize> {
    /// ν, or κ: rates of the coordinates.
    pub(crate) rates: &'a mut [Row<L, N>],
    /// L_q + Q, or π: rates of the momenta.
    pub(crate) forces: &'a mut [Row<L, N>],
    pub(crate) momenta: &'a mut [Row<L, N>],
    /// The velocities in phase space.
    pub(crate) velocities: &'a mut [Row<L, N>],
    /// Products of the tables with the unknowns.
    pub(crate) products: &'a mut [Row<L, N>],
    pub(crate) more_products: &'a mut [Row<L, N>],
    /// The contributions of the low words of the start and of the tables.
    pub(crate) low_position: &'a mut [Row<L, N>],
    pub(crate) low_momentum: &'a mut [Row<L, N>],
    /// The LU factors of L_vv, or H_pp, where they are not constant.
    pub(crate) masses: &'a mut [[Row<L, N>; N]],
}

impl<const L: usize, const N: usize> Rows<'_, L, N> {
    /// Computes the contributions of the low words of the start and of the tables at the points.
    #[inline(always)]
    pub(crate) fn set_low<V, A, M>(self, like: V, at: &A)
    where
        V: Side<L>,
        A: Arrangement<V, L, N>,
        M: Model<N>,
    {
        let acting = &const { acting::<M, N>() };
        let (tables, h) = (at.tables(), like.like(at.h()));
        let of_rates = match tables.projected.first() {
            None => &tables.once_low,
            Some(projection) => &projection.position_low,
        };
        at.apply(like, of_rates, acting, self.rates, self.products);
        at.apply(
            like,
            &tables.once_low,
            acting,
            self.forces,
            self.more_products,
        );
        for (low, product) in self.low_position.iter_mut().zip(self.products) {
            for a in 0..N {
                if M::IGNORABLE[a] {
                    continue;
                }
                let product = like.with(product[a]);
                low[a] = h.times_plus(product, at.low(like, a).0).lanes();
            }
        }
        for (low, product) in self.low_momentum.iter_mut().zip(self.more_products) {
            for a in 0..N {
                let of_start = at.low(like, a).1;
                low[a] = with_product::<V, M, L, N>(h, (product, a), of_start).lanes();
            }
        }
    }

    /// One iteration for a Lagrangian: momenta and forces at the velocities, then velocities that belong to the
    /// required momenta. Returns how much these have changed, and how large they are.
    #[inline(always)]
    pub(crate) fn sweep_velocity<V, A, M>(
        self,
        like: V,
        model: &M,
        at: &A,
        evaluation: &mut Evaluation<V, N>,
        refresh: bool,
    ) -> (Magnitude<V>, Magnitude<V>)
    where
        V: Side<L>,
        A: Arrangement<V, L, N>,
        M: Model<N>,
    {
        let (tables, h, zero) = (at.tables(), like.like(at.h()), like.like(0.0));
        let rates = self.rates;
        let count = rates.len();
        let forces = &mut self.forces[..count];
        let momenta = &mut self.momenta[..count];
        let products = &mut self.products[..count];
        let more_products = &mut self.more_products[..count];
        let low_position = &self.low_position[..count];
        let low_momentum = &self.low_momentum[..count];
        let nodes = &A::entries(&tables.nodes)[..count];
        let masses = self.masses;
        let projection = tables.projected.first();
        let acting = &const { acting::<M, N>() };
        match projection {
            None => at.apply(like, &tables.once, acting, rates, products),
            Some(projection) => at.apply(like, &projection.position, acting, rates, products),
        }
        for c in 0..count {
            let Evaluation { q, z: v, first } = evaluation;
            for a in 0..N {
                if !M::IGNORABLE[a] {
                    let low = like.with(low_position[c][a]);
                    q[a] = at.start(like, a).0 + h.times_plus(like.with(products[c][a]), low);
                }
                v[a] = like.with(rates[c][a]);
            }
            let t = at.time(like, nodes[c]);
            if const { !M::FACTS.constant_mass } && refresh {
                let mut mass = [[zero; N]; N];
                A::first(model, t, (q, v), first, Some(&mut mass));
                factor(like, &mut mass);
                store(&mut masses[c], &mass);
            } else {
                A::first(model, t, (q, v), first, None);
            }
            for a in 0..N {
                momenta[c][a] = (first.z[a] - at.start(like, a).1).lanes();
                at.set(&mut forces[c][a], first.q[a] + first.force[a]);
            }
        }
        if let Some(projection) = projection {
            more_products.copy_from_slice(momenta);
            let (onto_rates, all) = (&projection.onto_rates, &[true; N]);
            at.apply(like, onto_rates, all, more_products, momenta);
        }
        at.apply(like, &tables.once, acting, forces, products);
        let (mut changed, mut size) = (Magnitude::none(like), Magnitude::none(like));
        // Two separate loops: most elements need the one without projection.
        if let Some(projection) = projection {
            for c in 0..count {
                let lacking = (&products[c], &low_momentum[c], &momenta[c]);
                let step = missing_velocity::<V, A, M, L, N>(like, at, lacking, masses.get(c));
                for a in 0..N {
                    more_products[c][a] = step[a].lanes();
                }
            }
            // With one mass matrix for all points, these would already be rates of the admissible degree.
            let (onto_rates, all) = (&projection.onto_rates, &[true; N]);
            at.apply(like, onto_rates, all, more_products, products);
            for c in 0..count {
                for a in 0..N {
                    let step = like.with(products[c][a]);
                    let rate = like.with(rates[c][a]) + step;
                    at.set(&mut rates[c][a], rate);
                    changed.raise(at.weighted(a, step));
                    size.raise(rate);
                }
            }
        } else {
            for c in 0..count {
                let lacking = (&products[c], &low_momentum[c], &momenta[c]);
                let step = missing_velocity::<V, A, M, L, N>(like, at, lacking, masses.get(c));
                for a in 0..N {
                    let rate = like.with(rates[c][a]) + step[a];
                    at.set(&mut rates[c][a], rate);
                    changed.raise(at.weighted(a, step[a]));
                    size.raise(rate);
                }
            }
        }
        (changed, size)
    }

    /// One iteration for a Hamiltonian: momenta, the velocities that belong to them, coordinates, and then both rates
    /// anew. Returns how much the rates of coordinates have changed and how large they are, and the same for the rates
    /// of momenta.
    #[inline(always)]
    pub(crate) fn sweep_phase<V, A, M>(
        self,
        like: V,
        model: &M,
        at: &A,
        evaluation: &mut Evaluation<V, N>,
        (is_first, refresh): (bool, bool),
    ) -> [(Magnitude<V>, Magnitude<V>); 2]
    where
        V: Side<L>,
        A: Arrangement<V, L, N>,
        M: Model<N>,
    {
        let (tables, h, zero) = (at.tables(), like.like(at.h()), like.like(0.0));
        let rates = self.rates;
        let count = rates.len();
        let forces = &mut self.forces[..count];
        let momenta = &mut self.momenta[..count];
        let velocities = &mut self.velocities[..count];
        let products = &mut self.products[..count];
        let low_position = &self.low_position[..count];
        let low_momentum = &self.low_momentum[..count];
        let nodes = &A::entries(&tables.nodes)[..count];
        let masses = self.masses;
        let acting = &const { acting::<M, N>() };
        at.apply(like, &tables.once, acting, forces, products);
        for c in 0..count {
            let mut changes = [zero; N];
            for a in 0..N {
                let low = like.with(low_momentum[c][a]);
                let change = with_product::<V, M, L, N>(h, (&products[c], a), low);
                let p = at.start(like, a).1 + change;
                changes[a] = p - like.with(momenta[c][a]);
                momenta[c][a] = p.lanes();
            }
            let mut by_change = [zero; N];
            if const { M::FACTS.constant_mass } {
                if !is_first {
                    by_change = at.inertia().times::<M, _>(like, &changes);
                }
            } else if !is_first {
                for a in 0..N {
                    for b in 0..N {
                        let mass = like.with(masses[c][a][b]);
                        by_change[a] = mass.times_plus(changes[b], by_change[a]);
                    }
                }
            }
            for a in 0..N {
                velocities[c][a] = (like.with(rates[c][a]) + by_change[a]).lanes();
            }
        }
        at.apply(like, &tables.once, acting, velocities, products);
        let none = Magnitude::none(like);
        let [mut of_rates, mut of_forces] = [(none, none); 2];
        for c in 0..count {
            let Evaluation { q, z: p, first } = evaluation;
            for a in 0..N {
                if !M::IGNORABLE[a] {
                    let low = like.with(low_position[c][a]);
                    q[a] = at.start(like, a).0 + h.times_plus(like.with(products[c][a]), low);
                }
                p[a] = like.with(momenta[c][a]);
            }
            let t = at.time(like, nodes[c]);
            if const { !M::FACTS.constant_mass } && refresh {
                let mut mass = [[zero; N]; N];
                A::first(model, t, (q, p), first, Some(&mut mass));
                store(&mut masses[c], &mass);
            } else {
                A::first(model, t, (q, p), first, None);
            }
            for a in 0..N {
                let (force, rate) = (first.force[a] - first.q[a], first.z[a]);
                let of_force = force - like.with(forces[c][a]);
                let of_rate = rate - like.with(rates[c][a]);
                of_forces.0.raise(at.weighted_force(a, of_force));
                of_rates.0.raise(at.weighted(a, of_rate));
                of_forces.1.raise(force);
                of_rates.1.raise(rate);
                at.set(&mut forces[c][a], force);
                at.set(&mut rates[c][a], rate);
            }
        }
        [of_rates, of_forces]
    }
}

/// low + h · a product with forces; the product is zero for coordinates without forces.
#[inline(always)]
fn with_product<V, M, const L: usize, const N: usize>(
    h: V,
    (products, a): (&Row<L, N>, usize),
    low: V,
) -> V
where
    V: Side<L>,
    M: Model<N>,
{
    if M::IGNORABLE[a] {
        return low;
    }
    h.times_plus(h.with(products[a]), low)
}

/// M⁻¹ times the residual of the momenta, from products of the tables with forces, low words, and the differences of
/// the momenta to those at the start.
#[inline(always)]
fn missing_velocity<V, A, M, const L: usize, const N: usize>(
    like: V,
    at: &A,
    (products, low, momenta): (&Row<L, N>, &Row<L, N>, &Row<L, N>),
    mass: Option<&[Row<L, N>; N]>,
) -> [V; N]
where
    V: Side<L>,
    A: Arrangement<V, L, N>,
    M: Model<N>,
{
    let (h, mut step) = (like.like(at.h()), [like.like(0.0); N]);
    for a in 0..N {
        let wanted = with_product::<V, M, L, N>(h, (products, a), like.with(low[a]));
        step[a] = wanted - like.with(momenta[a]);
    }
    if const { M::FACTS.constant_mass } {
        return at.inertia().times::<M, _>(like, &step);
    }
    if let Some(mass) = mass {
        solve(like, mass, &mut step);
    }
    step
}
