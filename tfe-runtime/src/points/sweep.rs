//! What all iterations have in common, and the arrangement of the points of one trajectory.

use super::arrangement::{Arrangement, Magnitude};
use super::evaluation::Evaluation;
use super::first_order::Rows;
use super::forms::acting;
use super::inertia::Inertia;
use super::second_order::{Forces, velocity_of};
use super::size::MIN_SIZE;
use super::{Row, StepInput, Work};
use crate::equations::Increment;
use crate::legendre::larger;
use crate::model::{First, Model};
use crate::registers::four::{Four, block, put};
use crate::registers::storage::{Fixed, Matrix, Storage};

impl<V: Four> Magnitude<V> {
    /// The largest magnitudes of two, over all lanes.
    #[inline(always)]
    fn of_both(one: Self, other: Self) -> (f64, f64) {
        let ([a, b, c, d], [e, f, g, h]) = (one.0.lanes(), other.0.lanes());
        let left = one.0.with([a, e, c, g]);
        let [a, e, c, g] = left.larger(left.with([b, f, d, h])).lanes();
        (larger(a, c), larger(e, g))
    }
}

/// |h δ| divided by the larger of `start`, which is not zero, and |h x|.
#[inline(always)]
fn beside(h: f64, start: f64, x: f64, change: f64) -> f64 {
    let h = h.abs();
    h * change / larger(start, h * x)
}

/// Four points of a trajectory.
impl<V: Four, const N: usize, S: Storage> Arrangement<V, 4, N> for StepInput<'_, N, S> {
    type Memory = S;
    type Number = f64;
    type Entry = [f64; 4];

    #[inline(always)]
    fn tables(&self) -> &Fixed<S> {
        self.tables
    }

    #[inline(always)]
    fn inertia(&self) -> &Inertia<N, S> {
        self.inertia
    }

    #[inline(always)]
    fn h(&self) -> f64 {
        self.h
    }

    #[inline(always)]
    fn number(&self, like: V, number: f64) -> V {
        like.like(number)
    }

    #[inline(always)]
    fn entries(vector: &[[f64; 4]]) -> &[[f64; 4]] {
        vector
    }

    #[inline(always)]
    fn entry(like: V, entry: [f64; 4]) -> V {
        like.with(entry)
    }

    #[inline(always)]
    fn time(&self, like: V, node: [f64; 4]) -> V {
        like.like(self.t) + like.like(self.h) * like.with(node)
    }

    #[inline(always)]
    fn start(&self, like: V, a: usize) -> (V, V) {
        (like.like(self.start.q[a]), like.like(self.start.p[a]))
    }

    #[inline(always)]
    fn low(&self, like: V, a: usize) -> (V, V) {
        (like.like(self.low.q[a]), like.like(self.low.p[a]))
    }

    #[inline(always)]
    fn apply(
        &self,
        like: V,
        table: &Matrix<S>,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        table.apply(like, wanted, rows, products);
    }

    #[inline(always)]
    fn factor(&self, like: V, a: usize) -> V {
        if const { N == 1 } {
            like.like(self.inertia.inverse_diagonal[a])
        } else {
            like.like(self.factors[a])
        }
    }

    #[inline(always)]
    fn weighted(&self, a: usize, change: V) -> V {
        if const { N == 1 } {
            change
        } else {
            change.like(self.factors[a]) * change
        }
    }

    #[inline(always)]
    fn weighted_force(&self, a: usize, change: V) -> V {
        if const { N == 1 } {
            change
        } else {
            change.like(self.force_factors[a]) * change
        }
    }

    #[inline(always)]
    fn set(&self, place: &mut [f64; 4], value: V) {
        *place = value.lanes();
    }

    #[inline(always)]
    fn first<M: Model<N>>(
        model: &M,
        t: V,
        (q, z): (&[V; N], &[V; N]),
        first: &mut First<V, N>,
        mass: Option<&mut [[V; N]; N]>,
    ) {
        match mass {
            Some(mass) => V::first_and_mass(model, t, q, z, first, mass),
            None => V::first(model, t, q, z, first),
        }
    }
}

impl<const N: usize, S: Storage> Work<N, S> {
    /// The rows for equations of first order.
    #[inline(always)]
    pub(super) fn rows(&mut self) -> Rows<'_, 4, N> {
        Rows {
            rates: &mut self.rates,
            forces: &mut self.forces,
            momenta: &mut self.momenta,
            velocities: &mut self.velocities,
            products: &mut self.products,
            more_products: &mut self.more_products,
            low_position: &mut self.low_position,
            low_momentum: &mut self.low_momentum,
            masses: &mut self.masses,
        }
    }

    /// The rows for M q̈ = f.
    #[inline(always)]
    pub(super) fn accelerated(&mut self) -> Forces<'_, f64, 4, N> {
        Forces {
            forces: &mut self.forces,
            products: &mut self.products,
            more_products: &mut self.more_products,
            drift: &mut self.drift,
            velocity: &self.velocity,
            velocity_low: &self.velocity_low,
        }
    }

    /// Computes the velocity at the start, and its rounding error.
    #[inline(always)]
    pub(super) fn begin_second_order<V: Four, M>(&mut self, like: V, input: &StepInput<'_, N, S>)
    where
        M: Model<N>,
    {
        let inertia = &input.inertia;
        if inertia.is_diagonal::<M>() {
            for at in (0..N).step_by(4) {
                let p = (
                    block(like, &input.start.p, at),
                    block(like, &input.low.p, at),
                );
                let inverse = block(like, &inertia.inverse_diagonal, at);
                let mass = block(like, &inertia.masses, at);
                let (v, v_low) = velocity_of(p, mass, inverse);
                put(v, &mut self.velocity, at);
                put(v_low, &mut self.velocity_low, at);
            }
            return;
        }
        for (a, row) in inertia.inverse.iter().enumerate() {
            let (mut v, mut low) = (0.0, 0.0);
            for b in 0..N {
                v += row[b] * input.start.p[b];
                low += row[b] * input.low.p[b];
            }
            (self.velocity[a], self.velocity_low[a]) = (v, low);
        }
    }

    /// A² f
    #[inline(always)]
    pub(super) fn integrate_twice<V: Four, M>(&mut self, like: V, input: &StepInput<'_, N, S>)
    where
        M: Model<N>,
    {
        let acting = &const { acting::<M, N>() };
        (input.tables.twice).apply(like, acting, &self.forces, &mut self.products);
    }

    /// One iteration for the forces of M q̈ = f.
    #[inline(always)]
    pub(super) fn sweep_second_order<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        input: &StepInput<'_, N, S>,
        at: &mut Evaluation<V, N>,
    ) -> Increment
    where
        M: Model<N>,
    {
        let (changed, size) = self.accelerated().sweep(like, model, input, at);
        let (changed, size) = Magnitude::of_both(changed, size);
        let h = input.h.abs();
        let speed = larger(self.speed, h * size);
        let distance = larger(self.distance, h * (self.speed + h * size));
        let velocity = h * changed / speed;
        let position = h * (0.5 * h * changed) / distance;
        // Either both are NaN or neither.
        let relative = larger(velocity, position);
        Increment { relative, position }
    }

    /// One iteration for the velocities of a Lagrangian.
    #[inline(always)]
    pub(super) fn sweep_velocity<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        input: &StepInput<'_, N, S>,
        at: &mut Evaluation<V, N>,
        refresh: bool,
    ) -> Increment
    where
        M: Model<N>,
    {
        let (changed, size) = (self.rows()).sweep_velocity(like, model, input, at, refresh);
        let (changed, size) = Magnitude::of_both(changed, size);
        let position = beside(input.h, self.distance, size, changed);
        // The momentum at the end is as accurate as the velocities, whatever the step. The rest of an increment affects
        // it through the forces only, hence the factor.
        let velocity = 0.25 * beside(1.0, MIN_SIZE, size, changed);
        let relative = if velocity > position {
            velocity
        } else {
            position
        };
        Increment { relative, position }
    }

    /// One iteration for the rates of a Hamiltonian.
    #[inline(always)]
    pub(super) fn sweep_phase<V: Four, M>(
        &mut self,
        like: V,
        model: &M,
        input: &StepInput<'_, N, S>,
        at: &mut Evaluation<V, N>,
        which: (bool, bool),
    ) -> Increment
    where
        M: Model<N>,
    {
        let [of_rates, of_forces] = self.rows().sweep_phase(like, model, input, at, which);
        let (changed, size) = Magnitude::of_both(of_rates.0, of_rates.1);
        let position = beside(input.h, self.distance, size, changed);
        let (changed, size) = Magnitude::of_both(of_forces.0, of_forces.1);
        let momentum = beside(input.h, self.speed, size, changed);
        let relative = if (position + momentum).is_nan() {
            f64::NAN
        } else {
            position.max(momentum)
        };
        Increment { relative, position }
    }
}
