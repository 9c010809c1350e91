//! The arrangement of trajectories side by side, for the iterations of `points`.

use super::group::{Ends, Group, Row, Work, Written};
use super::products::apply;
use super::step::Step;
use crate::model::{First, Model};
use crate::points::arrangement::Arrangement;
use crate::points::first_order::Rows;
use crate::points::inertia::Inertia;
use crate::points::second_order::Forces;
use crate::registers::pair::{Eight, LANES};
use crate::registers::storage::{Fixed, Heap, Matrix};

/// Eight trajectories, some of which are written.
pub(super) struct Trajectories<'a, M, V: Eight, const N: usize> {
    step: &'a Step<'a, M, N>,
    start: &'a Ends<N>,
    low: &'a Ends<N>,
    written: Written<V>,
}

impl<M, V: Eight, const N: usize> Arrangement<V, LANES, N> for Trajectories<'_, M, V, N> {
    type Memory = Heap;
    type Number = [f64; LANES];
    type Entry = f64;

    #[inline(always)]
    fn tables(&self) -> &Fixed<Heap> {
        self.step.tables
    }

    #[inline(always)]
    fn inertia(&self) -> &Inertia<N, Heap> {
        self.step.inertia
    }

    #[inline(always)]
    fn h(&self) -> f64 {
        self.step.h
    }

    #[inline(always)]
    fn number(&self, like: V, number: [f64; LANES]) -> V {
        like.with(number)
    }

    #[inline(always)]
    fn entries(vector: &[[f64; 4]]) -> &[f64] {
        vector.as_flattened()
    }

    #[inline(always)]
    fn entry(like: V, entry: f64) -> V {
        like.like(entry)
    }

    #[inline(always)]
    fn time(&self, like: V, node: f64) -> V {
        like.like(self.step.t + self.step.h * node)
    }

    #[inline(always)]
    fn start(&self, like: V, a: usize) -> (V, V) {
        (like.with(self.start.q[a]), like.with(self.start.p[a]))
    }

    #[inline(always)]
    fn low(&self, like: V, a: usize) -> (V, V) {
        (like.with(self.low.q[a]), like.with(self.low.p[a]))
    }

    #[inline(always)]
    fn apply(
        &self,
        like: V,
        table: &Matrix<Heap>,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        apply(like, table, wanted, rows, products);
    }

    #[inline(always)]
    fn set(&self, place: &mut [f64; LANES], value: V) {
        self.written.put(place, value);
    }

    #[inline(always)]
    fn first<K: Model<N>>(
        model: &K,
        t: V,
        (q, z): (&[V; N], &[V; N]),
        first: &mut First<V, N>,
        mass: Option<&mut [[V; N]; N]>,
    ) {
        match mass {
            Some(mass) => model.first_and_mass_inline(t, q, z, first, mass),
            None => model.first_inline(t, q, z, first),
        }
    }
}

impl<M, const N: usize> Step<'_, M, N> {
    #[inline(always)]
    fn lying<'a, V: Eight>(
        &'a self,
        (start, low): (&'a Ends<N>, &'a Ends<N>),
        written: Written<V>,
    ) -> Trajectories<'a, M, V, N> {
        Trajectories {
            step: self,
            start,
            low,
            written,
        }
    }

    /// The arrangement, and its rows for equations of first order.
    #[inline(always)]
    pub(super) fn rows<'a, V: Eight>(
        &'a self,
        group: &'a mut Group<N>,
        work: &'a mut Work<N>,
        written: Written<V>,
    ) -> (Trajectories<'a, M, V, N>, Rows<'a, LANES, N>) {
        let at = self.lying((&group.start, &group.low), written);
        let rows = Rows {
            rates: &mut group.rates,
            forces: &mut group.forces,
            momenta: &mut work.momenta,
            velocities: &mut work.velocities,
            products: &mut work.products,
            more_products: &mut work.more_products,
            low_position: &mut work.low_position,
            low_momentum: &mut work.low_momentum,
            masses: &mut work.masses,
        };
        (at, rows)
    }

    /// The arrangement, and its rows for M q̈ = f.
    #[inline(always)]
    pub(super) fn accelerated<'a, V: Eight>(
        &'a self,
        group: &'a mut Group<N>,
        work: &'a mut Work<N>,
        written: Written<V>,
    ) -> (
        Trajectories<'a, M, V, N>,
        Forces<'a, [f64; LANES], LANES, N>,
    ) {
        let at = self.lying((&group.start, &group.low), written);
        let forces = Forces {
            forces: &mut group.forces,
            products: &mut work.products,
            more_products: &mut work.more_products,
            drift: &mut work.drift,
            velocity: &work.velocity,
            velocity_low: &work.velocity_low,
        };
        (at, forces)
    }
}
