//! First-order equations, and what all iterations share.

use super::{Inertia, Leg, Row, Work};
use crate::double_double::DoubleDouble;
use crate::equations::Increment;
use crate::model::{First, Model};
use crate::real::Real;
use crate::registers::four::{Four, Precise};
use crate::registers::storage::Storage;

/// The largest magnitude so far in each lane. NaN is left out: the end of a step is not finite where one of its forces is not, and that is looked at once a step.
#[derive(Clone, Copy)]
pub(crate) struct Magnitude<V>(V);

impl<V: Four> Magnitude<V> {
    #[inline(always)]
    pub(crate) fn none(like: V) -> Self {
        Self(like.like(0.0))
    }

    #[inline(always)]
    pub(crate) fn raise(&mut self, value: V) {
        self.0 = value.abs().larger(self.0);
    }

    /// Of all lanes.
    #[inline(always)]
    pub(crate) fn get(self) -> f64 {
        let [a, b, c, d] = self.0.lanes();
        larger(larger(a, b), larger(c, d))
    }
}

/// The largest magnitude so far in each lane, and a sum that shows what is no number.
#[cfg(feature = "alloc")]
#[derive(Clone, Copy)]
pub(crate) struct Largest<V> {
    size: V,
    sum: V,
}

#[cfg(feature = "alloc")]
impl<V: Precise> Largest<V> {
    #[inline(always)]
    pub(crate) fn none(like: V) -> Self {
        let zero = like.like(0.0);
        Self {
            size: zero,
            sum: zero,
        }
    }

    #[inline(always)]
    pub(crate) fn raise(&mut self, value: V) {
        self.size = value.abs().larger(self.size);
        self.sum += value;
    }

    /// The same for a value of which others tell whether it is finite.
    #[inline(always)]
    pub(crate) fn raise_finite(&mut self, value: V) {
        self.size = value.abs().larger(self.size);
    }

    /// One for each lane; NaN where one value of that lane was not finite.
    #[inline(always)]
    pub(crate) fn by_lane(self) -> V {
        self.size + self.sum * self.sum.like(0.0)
    }

    /// Of all lanes; NaN if one value was not finite.
    #[inline(always)]
    pub(crate) fn get(self) -> f64
    where
        V: Four,
    {
        let [a, b, c, d] = self.by_lane().lanes();
        larger(larger(a, b), larger(c, d)) + 0.0 * ((a + b) + (c + d))
    }
}

/// The larger one; in one instruction, which nothing asks about NaN.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a < b { b } else { a }
}

/// |h δ| over the larger one of start and |h x|; zero over zero is zero, NaN stays NaN.
#[inline(always)]
pub(crate) fn relative(h: f64, start: f64, x: f64, step: f64) -> f64 {
    let scale = start.max(h.abs() * x);
    if step == 0.0 {
        0.0
    } else {
        h.abs() * step / scale
    }
}

impl<const N: usize, S: Storage> Work<N, S> {
    /// What low words of the start and of the tables add at the points.
    #[inline(always)]
    pub(super) fn set_low<V: Four>(&mut self, like: V, leg: &Leg<'_, N, S>) {
        let (products, more_products) = (&mut self.products, &mut self.more_products);
        match leg.tables.projected.first() {
            None => (leg.tables.once_low).apply(like, &self.rates, products),
            Some(projection) => (projection.position_low).apply(like, &self.rates, products),
        }
        (leg.tables.once_low).apply(like, &self.forces, more_products);
        let h = like.like(leg.h);
        for (low, product) in self.low_position.iter_mut().zip(products.iter()) {
            for a in 0..N {
                let product = like.with(product[a]);
                low[a] = h.times_plus(product, like.like(leg.low.q[a])).lanes();
            }
        }
        for (low, product) in self.low_momentum.iter_mut().zip(more_products.iter()) {
            for a in 0..N {
                let product = like.with(product[a]);
                low[a] = h.times_plus(product, like.like(leg.low.p[a])).lanes();
            }
        }
    }

    /// A Lagrangian: momenta and forces at the velocities, then velocities that belong to the momenta asked for.
    #[inline(always)]
    pub(super) fn sweep_velocity<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        leg: &Leg<'_, N, S>,
        at: &mut Evaluation<'_, V, N>,
        refresh: bool,
    ) -> Increment
    where
        M: Model<N>,
    {
        let (h, zero) = (like.like(leg.h), like.like(0.0));
        let rates = &mut self.rates;
        let count = rates.len();
        let forces = &mut self.forces[..count];
        let momenta = &mut self.momenta[..count];
        let products = &mut self.products[..count];
        let low_position = &self.low_position[..count];
        let low_momentum = &self.low_momentum[..count];
        let nodes = &leg.tables.nodes[..count];
        let masses = &mut self.masses;
        let more_products = &mut self.more_products[..count];
        let projection = leg.tables.projected.first();
        match projection {
            None => leg.tables.once.apply(like, rates, products),
            Some(projection) => projection.position.apply(like, rates, products),
        }
        for c in 0..count {
            let Evaluation { q, z: v, first } = at;
            for a in 0..N {
                let low = like.with(low_position[c][a]);
                let moved = h.times_plus(like.with(products[c][a]), low);
                q[a] = like.like(leg.start.q[a]) + moved;
                v[a] = like.with(rates[c][a]);
            }
            let t = like.like(leg.t) + h * like.with(nodes[c]);
            if const { !M::FACTS.constant_mass } && refresh {
                let mut mass = [[zero; N]; N];
                V::first_and_mass(model, t, q, v, first, &mut mass);
                factor(like, &mut mass);
                store(&mut masses[c], &mass);
            } else {
                V::first(model, t, q, v, first);
            }
            for a in 0..N {
                momenta[c][a] = (first.z[a] - like.like(leg.start.p[a])).lanes();
                forces[c][a] = (first.q[a] + first.force[a]).lanes();
            }
        }
        if let Some(projection) = projection {
            more_products.copy_from_slice(momenta);
            projection.onto_rates.apply(like, more_products, momenta);
        }
        leg.tables.once.apply(like, forces, products);
        let (mut changed, mut size) = (Magnitude::none(like), Magnitude::none(like));
        // The loops apart: the one without projection is what most elements go through.
        if let Some(projection) = projection {
            for c in 0..count {
                let momenta = (&products[c], &low_momentum[c], &momenta[c]);
                let step = leg.missing_velocity::<V, M>(like, momenta, masses.get(c));
                for a in 0..N {
                    more_products[c][a] = step[a].lanes();
                }
            }
            // With one mass matrix for all points these would lie among the rates already.
            projection.onto_rates.apply(like, more_products, products);
            for c in 0..count {
                for a in 0..N {
                    let step = like.with(products[c][a]);
                    let rate = like.with(rates[c][a]) + step;
                    rates[c][a] = rate.lanes();
                    changed.raise(step);
                    size.raise(rate);
                }
            }
        } else {
            for c in 0..count {
                let momenta = (&products[c], &low_momentum[c], &momenta[c]);
                let step = leg.missing_velocity::<V, M>(like, momenta, masses.get(c));
                for a in 0..N {
                    let rate = like.with(rates[c][a]) + step[a];
                    rates[c][a] = rate.lanes();
                    changed.raise(step[a]);
                    size.raise(rate);
                }
            }
        }
        let (changed, size) = (changed.get(), size.get());
        let position = relative(leg.h, self.distance, size, changed);
        // The momentum at the end is as good as the velocities, whatever the step; what is left of an increment reaches it through forces
        // only, hence the factor.
        let velocity = 0.25 * relative(1.0, 0.0, size, changed);
        let relative = if velocity > position {
            velocity
        } else {
            position
        };
        Increment { relative, position }
    }

    /// A Hamiltonian: momenta, the velocities that belong to them, coordinates, and then both rates anew.
    #[inline(always)]
    pub(super) fn sweep_phase<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        leg: &Leg<'_, N, S>,
        at: &mut Evaluation<'_, V, N>,
        is_first: bool,
        refresh: bool,
    ) -> Increment
    where
        M: Model<N>,
    {
        let (h, zero) = (like.like(leg.h), like.like(0.0));
        let rates = &mut self.rates;
        let count = rates.len();
        let forces = &mut self.forces[..count];
        let momenta = &mut self.momenta[..count];
        let velocities = &mut self.velocities[..count];
        let products = &mut self.products[..count];
        let low_position = &self.low_position[..count];
        let low_momentum = &self.low_momentum[..count];
        let nodes = &leg.tables.nodes[..count];
        let masses = &mut self.masses;
        leg.tables.once.apply(like, forces, products);
        for c in 0..count {
            let mut change = [zero; N];
            for a in 0..N {
                let low = like.with(low_momentum[c][a]);
                let moved = h.times_plus(like.with(products[c][a]), low);
                let p = like.like(leg.start.p[a]) + moved;
                change[a] = p - like.with(momenta[c][a]);
                momenta[c][a] = p.lanes();
            }
            let mut by_change = [zero; N];
            if const { M::FACTS.constant_mass } {
                if !is_first {
                    by_change = leg.inertia.times(like, &change);
                }
            } else if !is_first {
                for a in 0..N {
                    for b in 0..N {
                        let mass = like.with(masses[c][a][b]);
                        by_change[a] = mass.times_plus(change[b], by_change[a]);
                    }
                }
            }
            for a in 0..N {
                velocities[c][a] = (like.with(rates[c][a]) + by_change[a]).lanes();
            }
        }
        leg.tables.once.apply(like, velocities, products);
        let none = Magnitude::none(like);
        let (mut force_changed, mut force_size) = (none, none);
        let (mut rate_changed, mut rate_size) = (none, none);
        for c in 0..count {
            let Evaluation { q, z: p, first } = at;
            for a in 0..N {
                let low = like.with(low_position[c][a]);
                let moved = h.times_plus(like.with(products[c][a]), low);
                q[a] = like.like(leg.start.q[a]) + moved;
                p[a] = like.with(momenta[c][a]);
            }
            let t = like.like(leg.t) + h * like.with(nodes[c]);
            if const { !M::FACTS.constant_mass } && refresh {
                let mut mass = [[zero; N]; N];
                V::first_and_mass(model, t, q, p, first, &mut mass);
                store(&mut masses[c], &mass);
            } else {
                V::first(model, t, q, p, first);
            }
            for a in 0..N {
                let force = first.force[a] - first.q[a];
                force_changed.raise(force - like.with(forces[c][a]));
                rate_changed.raise(first.z[a] - like.with(rates[c][a]));
                force_size.raise(force);
                rate_size.raise(first.z[a]);
                forces[c][a] = force.lanes();
                rates[c][a] = first.z[a].lanes();
            }
        }
        let (force_changed, rate_changed) = (force_changed.get(), rate_changed.get());
        let position = relative(leg.h, self.distance, rate_size.get(), rate_changed);
        let momentum = relative(leg.h, self.speed, force_size.get(), force_changed);
        let relative = if (position + momentum).is_nan() {
            f64::NAN
        } else {
            position.max(momentum)
        };
        Increment { relative, position }
    }
}

impl<const N: usize, S: Storage> Leg<'_, N, S> {
    /// M⁻¹ times what momenta lack: from products of the tables with forces, low words, and what the momenta are more than that at the start.
    #[inline(always)]
    fn missing_velocity<V: Four, M>(
        &self,
        like: V,
        (products, low, momenta): (&Row<N>, &Row<N>, &Row<N>),
        mass: Option<&[Row<N>; N]>,
    ) -> [V; N]
    where
        M: Model<N>,
    {
        let (h, mut step) = (like.like(self.h), [like.like(0.0); N]);
        for a in 0..N {
            let wanted = h.times_plus(like.with(products[a]), like.with(low[a]));
            step[a] = wanted - like.with(momenta[a]);
        }
        if const { M::FACTS.constant_mass } {
            return self.inertia.times(like, &step);
        }
        if let Some(mass) = mass {
            solve(like, mass, &mut step);
        }
        step
    }
}

impl<const N: usize, S: Storage> Inertia<N, S> {
    /// The constant M⁻¹ (or H_pp) times a vector for each of several points.
    #[inline(always)]
    pub(crate) fn times<V: Precise>(&self, like: V, vector: &[V; N]) -> [V; N] {
        let mut product = [like.like(0.0); N];
        if self.diagonal.is_some() {
            for a in 0..N {
                product[a] = like.like(self.inverse_diagonal[a]) * vector[a];
            }
            return product;
        }
        for (a, row) in self.inverse.iter().enumerate() {
            for b in 0..N {
                product[a] = like.like(row[b]).times_plus(vector[b], product[a]);
            }
        }
        product
    }

    /// Coordinates at four points: start + drift + h² M⁻¹ · products.
    #[inline(always)]
    pub(super) fn positions<V: Four, const DIAGONAL: bool>(
        &self,
        square: V,
        start: &[f64; N],
        (products, drift): (&Row<N>, &Row<N>),
        q: &mut [V; N],
    ) {
        for a in 0..N {
            let rate = if const { DIAGONAL } {
                square.like(self.inverse_diagonal[a]) * square.with(products[a])
            } else {
                self.row(square, products, a)
            };
            let moved = square.times_plus(rate, square.with(drift[a]));
            q[a] = square.like(start[a]) + moved;
        }
    }

    /// One line of it times the numbers at four points.
    #[inline(always)]
    pub(super) fn row<V: Four>(&self, like: V, row: &Row<N>, a: usize) -> V {
        if self.diagonal.is_some() {
            return like.like(self.inverse_diagonal[a]) * like.with(row[a]);
        }
        let mut sum = like.like(0.0);
        for b in 0..N {
            sum = like
                .like(self.inverse[a][b])
                .times_plus(like.with(row[b]), sum);
        }
        sum
    }

    /// The same of a number and what rounding took from it.
    #[inline(always)]
    pub(super) fn of_both(&self, high: &[f64; N], low: &[f64; N]) -> ([f64; N], [f64; N]) {
        let (mut of_high, mut of_low) = ([0.0; N], [0.0; N]);
        for (a, row) in self.inverse.iter().enumerate() {
            let mut sum = DoubleDouble::ZERO;
            for b in 0..N {
                let product = DoubleDouble::product(row[b], high[b]);
                sum = sum.plus(product).plus(DoubleDouble::new(row[b] * low[b]));
            }
            (of_high[a], of_low[a]) = (sum.high, sum.low);
        }
        (of_high, of_low)
    }
}

#[inline(always)]
fn store<V: Four, const N: usize>(to: &mut [Row<N>; N], matrix: &[[V; N]; N]) {
    for a in 0..N {
        for b in 0..N {
            to[a][b] = matrix[a][b].lanes();
        }
    }
}

/// Where a kernel is evaluated, and what it writes there. Entries that are always zero are never written, so one serves for all points of a step: with many coordinates it takes as
/// long to fill them with zeros as to evaluate a kernel.
pub(super) struct Evaluation<'a, V, const N: usize> {
    pub(super) q: &'a mut [V; N],
    pub(super) z: &'a mut [V; N],
    pub(super) first: &'a mut First<V, N>,
}

#[inline(always)]
pub(crate) fn no_derivatives<V: Real, const N: usize>(like: V) -> First<V, N> {
    let zero = [like.like(0.0); N];
    First {
        z: zero,
        q: zero,
        force: zero,
    }
}

/// Factors without exchanging rows: a mass matrix is positive definite, and where it is not the iteration does not converge and the step is
/// left to another method. The diagonal holds the inverse pivots.
#[inline(always)]
pub(crate) fn factor<V: Precise, const N: usize>(like: V, matrix: &mut [[V; N]; N]) {
    for column in 0..N {
        let inverse = like.like(1.0) / matrix[column][column];
        matrix[column][column] = inverse;
        for row in column + 1..N {
            let factor = matrix[row][column] * inverse;
            matrix[row][column] = factor;
            for j in column + 1..N {
                matrix[row][j] = (-factor).times_plus(matrix[column][j], matrix[row][j]);
            }
        }
    }
}

#[inline(always)]
fn solve<V: Four, const N: usize>(like: V, factors: &[Row<N>; N], vector: &mut [V; N]) {
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
