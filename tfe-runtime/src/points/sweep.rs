//! First-order equations, and what all iterations share.

use super::four::Four;
use super::{Inertia, Leg, Points};
use crate::equations::Increment;
use crate::legendre::largest;
use crate::model::{First, Model};
use crate::real::Real;

/// The largest magnitude so far in each lane, and a sum that shows what is no number.
#[derive(Clone, Copy)]
pub(crate) struct Largest<V> {
    size: V,
    sum: V,
}

impl<V: Real> Largest<V> {
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
        let size = value.abs();
        self.size = V::select(self.size.less(size), size, self.size);
        self.sum += value;
    }

    /// One for each lane; NaN where one value of that lane was not finite.
    #[inline(always)]
    pub(crate) fn by_lane(self) -> V {
        self.size + self.sum * self.sum.like(0.0)
    }
}

impl<V: Four> Largest<V> {
    /// NaN if one value was not finite.
    #[inline(always)]
    pub(super) fn get(self) -> f64 {
        let ([a, b, c, d], [e, f, g, h]) = (self.size.lanes(), self.sum.lanes());
        let zero = 0.0 * ((e + f) + (g + h));
        a.max(b).max(c.max(d)) + zero
    }
}

/// |h δ| over the larger one of start and |h x|; zero over zero is zero, NaN stays NaN.
#[inline(always)]
pub(super) fn relative(h: f64, start: f64, x: f64, step: f64) -> f64 {
    let scale = start.max(h.abs() * x);
    if step == 0.0 {
        0.0
    } else {
        h.abs() * step / scale
    }
}

impl<const N: usize> Points<N> {
    /// What low words of the start and of the tables add at the points.
    #[inline(always)]
    pub(super) fn begin<V: Four>(&mut self, like: V, leg: &Leg<'_, N>) {
        self.tables
            .once_low
            .apply(like, &self.rates, &mut self.products);
        self.tables
            .once_low
            .apply(like, &self.forces, &mut self.more_products);
        let (groups, h) = (self.tables.groups, like.like(leg.h));
        for a in 0..N {
            let (low_q, low_p) = (like.like(leg.low.q[a]), like.like(leg.low.p[a]));
            for k in a * groups..(a + 1) * groups {
                let moved = h * like.with(self.products[k]);
                self.low_position[k] = (low_q + moved).lanes();
                let moved = h * like.with(self.more_products[k]);
                self.low_momentum[k] = (low_p + moved).lanes();
            }
        }
    }

    /// A Lagrangian: momenta and forces at the velocities, then velocities that belong to the momenta asked for.
    #[inline(always)]
    pub(super) fn sweep_velocity<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        leg: &Leg<'_, N>,
        refresh: bool,
    ) -> Increment
    where
        M: Model<N>,
    {
        let (groups, h, zero) = (self.tables.groups, like.like(leg.h), like.like(0.0));
        self.tables
            .once
            .apply(like, &self.rates, &mut self.products);
        for c in 0..groups {
            let (mut q, mut v) = ([zero; N], [zero; N]);
            for a in 0..N {
                let k = a * groups + c;
                let moved = h * like.with(self.products[k]) + like.with(self.low_position[k]);
                q[a] = like.like(leg.start.q[a]) + moved;
                v[a] = like.with(self.rates[k]);
            }
            let t = like.like(leg.t) + h * like.with(self.tables.nodes[c]);
            let mut first = no_derivatives(like);
            if const { !M::FACTS.constant_mass } && refresh {
                let mut mass = [[zero; N]; N];
                V::first_and_mass(model, t, &q, &v, &mut first, &mut mass);
                factor(like, &mut mass);
                store(&mut self.masses[c], &mass);
            } else {
                V::first(model, t, &q, &v, &mut first);
            }
            for a in 0..N {
                let k = a * groups + c;
                self.momenta[k] = first.z[a].lanes();
                self.forces[k] = (first.q[a] + first.force[a]).lanes();
            }
        }
        self.tables
            .once
            .apply(like, &self.forces, &mut self.products);
        let (mut changed, mut size) = (Largest::none(like), Largest::none(like));
        for c in 0..groups {
            let mut step = [zero; N];
            for a in 0..N {
                let k = a * groups + c;
                let wanted = h * like.with(self.products[k]) + like.with(self.low_momentum[k]);
                step[a] = wanted - (like.with(self.momenta[k]) - like.like(leg.start.p[a]));
            }
            if const { M::FACTS.constant_mass } {
                step = self.inertia.times(like, &step);
            } else {
                solve(like, &self.masses[c], &mut step);
            }
            for a in 0..N {
                let k = a * groups + c;
                let rate = like.with(self.rates[k]) + step[a];
                self.rates[k] = rate.lanes();
                changed.raise(step[a]);
                size.raise(rate);
            }
        }
        let (changed, size) = (changed.get(), size.get());
        let position = relative(leg.h, largest(&leg.start.q), size, changed);
        // The momentum at the end is as good as the velocities, whatever the step; what is left of an increment reaches it through forces
        // only, hence the factor.
        let velocity = 0.25 * relative(1.0, 0.0, size, changed);
        let relative = velocity.max(position);
        Increment { relative, position }
    }

    /// A Hamiltonian: momenta, the velocities that belong to them, coordinates, and then both rates anew.
    #[inline(always)]
    pub(super) fn sweep_phase<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        leg: &Leg<'_, N>,
        is_first: bool,
        refresh: bool,
    ) -> Increment
    where
        M: Model<N>,
    {
        let (groups, h, zero) = (self.tables.groups, like.like(leg.h), like.like(0.0));
        self.tables
            .once
            .apply(like, &self.forces, &mut self.products);
        for c in 0..groups {
            let mut change = [zero; N];
            for a in 0..N {
                let k = a * groups + c;
                let moved = h * like.with(self.products[k]) + like.with(self.low_momentum[k]);
                let p = like.like(leg.start.p[a]) + moved;
                change[a] = p - like.with(self.momenta[k]);
                self.momenta[k] = p.lanes();
            }
            let mut by_change = [zero; N];
            if !is_first && M::FACTS.constant_mass {
                by_change = self.inertia.times(like, &change);
            } else if !is_first {
                for a in 0..N {
                    for b in 0..N {
                        by_change[a] += like.with(self.masses[c][a][b]) * change[b];
                    }
                }
            }
            for a in 0..N {
                let k = a * groups + c;
                self.velocities[k] = (like.with(self.rates[k]) + by_change[a]).lanes();
            }
        }
        self.tables
            .once
            .apply(like, &self.velocities, &mut self.products);
        let none = Largest::none(like);
        let (mut force_changed, mut force_size) = (none, none);
        let (mut rate_changed, mut rate_size) = (none, none);
        for c in 0..groups {
            let (mut q, mut p) = ([zero; N], [zero; N]);
            for a in 0..N {
                let k = a * groups + c;
                let moved = h * like.with(self.products[k]) + like.with(self.low_position[k]);
                q[a] = like.like(leg.start.q[a]) + moved;
                p[a] = like.with(self.momenta[k]);
            }
            let t = like.like(leg.t) + h * like.with(self.tables.nodes[c]);
            let mut first = no_derivatives(like);
            if const { !M::FACTS.constant_mass } && refresh {
                let mut mass = [[zero; N]; N];
                V::first_and_mass(model, t, &q, &p, &mut first, &mut mass);
                store(&mut self.masses[c], &mass);
            } else {
                V::first(model, t, &q, &p, &mut first);
            }
            for a in 0..N {
                let k = a * groups + c;
                let force = first.force[a] - first.q[a];
                force_changed.raise(force - like.with(self.forces[k]));
                rate_changed.raise(first.z[a] - like.with(self.rates[k]));
                force_size.raise(force);
                rate_size.raise(first.z[a]);
                self.forces[k] = force.lanes();
                self.rates[k] = first.z[a].lanes();
            }
        }
        let start = leg.start;
        let (force_changed, rate_changed) = (force_changed.get(), rate_changed.get());
        let position = relative(leg.h, largest(&start.q), rate_size.get(), rate_changed);
        let momentum = relative(leg.h, largest(&start.p), force_size.get(), force_changed);
        let relative = if (position + momentum).is_nan() {
            f64::NAN
        } else {
            position.max(momentum)
        };
        Increment { relative, position }
    }
}

impl<const N: usize> Inertia<N> {
    /// The constant M⁻¹ (or H_pp) times a vector for each of four.
    #[inline(always)]
    pub(crate) fn times<V: Real>(&self, like: V, vector: &[V; N]) -> [V; N] {
        let mut product = [like.like(0.0); N];
        for (a, row) in self.inverse.iter().enumerate() {
            if self.diagonal.is_some() {
                product[a] = like.like(row[a]) * vector[a];
                continue;
            }
            for b in 0..N {
                product[a] += like.like(row[b]) * vector[b];
            }
        }
        product
    }
}

#[inline(always)]
fn store<V: Four, const N: usize>(to: &mut [[[f64; 4]; N]; N], matrix: &[[V; N]; N]) {
    for a in 0..N {
        for b in 0..N {
            to[a][b] = matrix[a][b].lanes();
        }
    }
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
pub(crate) fn factor<V: Real, const N: usize>(like: V, matrix: &mut [[V; N]; N]) {
    for column in 0..N {
        let inverse = like.like(1.0) / matrix[column][column];
        matrix[column][column] = inverse;
        for row in column + 1..N {
            let factor = matrix[row][column] * inverse;
            matrix[row][column] = factor;
            for j in column + 1..N {
                matrix[row][j] = matrix[row][j] - factor * matrix[column][j];
            }
        }
    }
}

#[inline(always)]
fn solve<V: Four, const N: usize>(like: V, factors: &[[[f64; 4]; N]; N], vector: &mut [V; N]) {
    for row in 0..N {
        for j in 0..row {
            vector[row] = vector[row] - like.with(factors[row][j]) * vector[j];
        }
    }
    for row in (0..N).rev() {
        for j in row + 1..N {
            vector[row] = vector[row] - like.with(factors[row][j]) * vector[j];
        }
        vector[row] = vector[row] * like.with(factors[row][row]);
    }
}
