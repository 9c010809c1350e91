//! The adjoint equations of an element M q̈ = f, solved by the same kind of fixed-point iteration as the element itself
//! (T-150).

use super::written::Points;
use crate::backwards::{AdjointMonitor, Units, largest_of_unlike, units};
use crate::family::inertia::Inertia;
use crate::family::model::{Block, Gradient, Model};
use crate::family::pattern::Pattern;
use crate::inside::Seeds as Within;
use crate::lanes::Lanes;
use crate::scheme::SchemeRef;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

const ZERO: Points = Lanes([0.0; 4]);

/// The numbers at all points of an element, in groups of four points: a row of n for each group. Numbers beyond the
/// last point are zero.
#[derive(Clone, Debug)]
pub(super) struct Iteration {
    /// b_l and β_j, one entry for each group.
    weights: Vec<Points>,
    advance: Vec<Points>,
    /// G_il and C_lj, for each i (or l) one entry for each group.
    force: Vec<Points>,
    position: Vec<Points>,
    points: usize,
    inverse_mass: Vec<f64>,
    /// `None` where the masses are of similar size.
    units: Option<Vec<Units>>,
    /// The places of second derivatives by coordinates, of forces by velocities, and of forces by coordinates.
    parts: [Part; 3],
    /// Second derivatives, a row for each group.
    values: Vec<Points>,
    gradient: [Vec<Points>; 3],
    /// The derivatives of a loss by rates and by forces inside the element.
    within: Option<[Vec<Points>; 2]>,
    pub(super) mu: Vec<Points>,
    pub(super) seeds: Vec<Points>,
    pulled: Vec<Points>,
    pushed: Vec<Points>,
}

/// The places of a sparsity pattern that belong to one block, with their rows and columns.
#[derive(Clone, Debug)]
struct Part {
    range: Range<usize>,
    places: Vec<(u32, u32)>,
}

impl Part {
    fn of(pattern: &Pattern, block: Block) -> Self {
        let places = pattern.places();
        let first = places.partition_point(|(own, ..)| *own < block);
        let last = places.partition_point(|(own, ..)| *own <= block);
        let pair = |(_, row, column): &(Block, usize, usize)| (*row as u32, *column as u32);
        Self {
            range: first..last,
            places: places[first..last].iter().map(pair).collect(),
        }
    }

    /// sum += valuesᵀ row
    #[inline(always)]
    fn add_transposed(&self, values: &[Points], row: &[Points], sum: &mut [Points]) {
        for ((from, to), value) in self.places.iter().zip(&values[self.range.clone()]) {
            sum[*to as usize] += *value * row[*from as usize];
        }
    }
}

/// The rows of a matrix in groups of four columns.
fn grouped(matrix: &[f64], columns: usize) -> Vec<Points> {
    let four = |part: &[f64]| {
        let mut four = ZERO;
        four.0[..part.len()].copy_from_slice(part);
        four
    };
    let rows = matrix.chunks_exact(columns);
    rows.flat_map(|row| row.chunks(4).map(four)).collect()
}

impl Iteration {
    /// The iteration for a collocated element.
    pub(super) fn new(scheme: &SchemeRef<'_>, pattern: &Pattern, inertia: Inertia) -> Self {
        let (points, n) = (scheme.points(), inertia.inverse.len());
        let masses = &inertia.mass;
        let largest = largest_of_unlike(masses);
        let own = |largest: f64| -> Vec<Units> {
            let all = masses.iter();
            all.map(|mass| units(*mass, largest)).collect()
        };
        let all = || vec![ZERO; points.div_ceil(4) * n];
        Self {
            weights: grouped(scheme.weights, points),
            advance: grouped(scheme.advance, points),
            force: grouped(scheme.force, points),
            position: grouped(scheme.position, points),
            points,
            units: largest.map(own),
            inverse_mass: inertia.inverse,
            parts: [Block::QQ, Block::ForceZ, Block::ForceQ].map(|one| Part::of(pattern, one)),
            values: vec![ZERO; points.div_ceil(4) * pattern.places().len()],
            gradient: [vec![ZERO; n], vec![ZERO; n], vec![ZERO; n]],
            within: None,
            mu: all(),
            seeds: all(),
            pulled: all(),
            pushed: all(),
        }
    }

    /// Evaluates the second derivatives at the points of the element.
    pub(super) fn linearise<M: Model>(
        &mut self,
        model: &M,
        pattern: &Pattern,
        (times, q, v): (&[Points], &[Points], &[Points]),
    ) {
        self.values.fill(ZERO);
        let n = self.inverse_mass.len();
        let groups = self.values.chunks_exact_mut(pattern.places().len().max(1));
        for (group, values) in groups.enumerate() {
            let own = group * n..(group + 1) * n;
            let [by_z, by_q, force] = &mut self.gradient;
            let first = Gradient {
                z: by_z,
                q: by_q,
                force,
            };
            let mut entries = pattern.add_to(values);
            model.second(times[group], &q[own.clone()], &v[own], first, &mut entries);
        }
    }

    /// The contributions of the seeds of forces to those of velocities.
    pub(super) fn set_by_velocities(&self, sums: &mut [Points]) {
        sums.fill(ZERO);
        let n = self.inverse_mass.len();
        let values = self.values.len() / self.weights.len();
        for g in 0..self.weights.len() {
            let own = g * n..(g + 1) * n;
            let values = &self.values[g * values..(g + 1) * values];
            let sums = &mut sums[own.clone()];
            self.parts[1].add_transposed(values, &self.seeds[own], sums);
        }
    }

    /// Moves λ backwards over the element and leaves μ and the seeds of forces; false, with λ unchanged, where the
    /// iteration does not contract.
    pub(super) fn pull(&mut self, h: f64, within: &Within, lambda: &mut [f64]) -> bool {
        let rows = |rows: &[f64]| -> Vec<Points> {
            let n = self.inverse_mass.len();
            let mut grouped = vec![ZERO; self.weights.len() * n];
            for (at, value) in rows.iter().enumerate() {
                let (l, a) = (at / n, at % n);
                grouped[l / 4 * n + a].0[l % 4] = *value;
            }
            grouped
        };
        self.within = match within.is_empty() {
            true => None,
            false => Some([rows(&within.rates), rows(&within.forces)]),
        };
        let solve = Solve {
            of: self,
            h,
            lambda: &*lambda,
        };
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        let solved = match pulp::x86::V3::try_new() {
            Some(isa) => isa.vectorize(solve),
            None => solve.run(),
        };
        #[cfg(not(all(feature = "simd", target_arch = "x86_64")))]
        let solved = solve.run();
        if !solved {
            return false;
        }
        let (of_p, of_q) = lambda.split_at_mut(self.inverse_mass.len());
        let add = |sums: &mut [f64], rows: &[Points]| {
            for group in rows.chunks_exact(sums.len().max(1)) {
                for (sum, four) in sums.iter_mut().zip(group) {
                    *sum += four.0.iter().sum::<f64>();
                }
            }
        };
        add(of_p, &self.mu);
        add(of_q, &self.pulled);
        true
    }
}

/// The iteration.
struct Solve<'a> {
    of: &'a mut Iteration,
    h: f64,
    lambda: &'a [f64],
}

/// Compiled for the widest registers, with the same roundings.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl pulp::NullaryFnOnce for Solve<'_> {
    type Output = bool;
    #[inline(always)]
    fn call(self) -> bool {
        self.run()
    }
}

impl Solve<'_> {
    #[inline(always)]
    fn run(self) -> bool {
        let Iteration {
            weights,
            advance,
            force,
            position,
            points,
            inverse_mass,
            units,
            parts,
            values,
            gradient: _,
            within,
            mu,
            seeds,
            pulled,
            pushed,
        } = self.of;
        let (n, groups) = (inverse_mass.len(), weights.len());
        let (of_p, of_q) = self.lambda.split_at(n);
        let h = splat(self.h);
        let [stiffness, damping, force_q] = parts;
        let count = values.len() / groups;
        mu.fill(ZERO);
        let mut monitor = AdjointMonitor::default();
        loop {
            for g in 0..groups {
                for a in 0..n {
                    let mut seed = weights[g] * splat(of_p[a]);
                    for i in 0..*points {
                        let mu = mu[i / 4 * n + a].0[i % 4];
                        seed += force[i * groups + g] * splat(mu);
                    }
                    seeds[g * n + a] = h * seed;
                    pushed[g * n + a] = h * advance[g] * splat(of_q[a]);
                    if let Some([rates, forces]) = within {
                        seeds[g * n + a] += forces[g * n + a];
                        pushed[g * n + a] += rates[g * n + a];
                    }
                }
                let own = g * n..(g + 1) * n;
                let values = &values[g * count..(g + 1) * count];
                let seeds = &seeds[own.clone()];
                let pulled = &mut pulled[own.clone()];
                pulled.fill(ZERO);
                stiffness.add_transposed(values, seeds, pulled);
                force_q.add_transposed(values, seeds, pulled);
                damping.add_transposed(values, seeds, &mut pushed[own]);
            }
            let (mut increment, mut size) = (ZERO, ZERO);
            let mut others = [(ZERO, ZERO); 2];
            for g in 0..groups {
                for a in 0..n {
                    let mut row = ZERO;
                    for l in 0..*points {
                        let pulled = pulled[l / 4 * n + a].0[l % 4];
                        row += position[l * groups + g] * splat(pulled);
                    }
                    row = (pushed[g * n + a] + h * row) * splat(inverse_mass[a]);
                    let old = &mut mu[g * n + a];
                    if let Some(units) = units {
                        for k in 0..2 {
                            let (increment, size) = &mut others[k];
                            for lane in 0..4 {
                                let change = units[a][k] * (row.0[lane] - old.0[lane]).abs();
                                increment.0[lane] = increment.0[lane].max(change);
                                let value = units[a][k] * row.0[lane].abs();
                                size.0[lane] = size.0[lane].max(value);
                            }
                        }
                    }
                    for lane in 0..4 {
                        let change = (row.0[lane] - old.0[lane]).abs();
                        // `f64::max` would ignore a NaN.
                        let largest = increment.0[lane];
                        let is_larger = change > largest || change.is_nan();
                        increment.0[lane] = if is_larger { change } else { largest };
                        size.0[lane] = size.0[lane].max(row.0[lane].abs());
                    }
                    *old = row;
                }
            }
            let mut beside = [(0.0, 0.0); 2];
            for k in 0..2 {
                let (increment, size) = others[k];
                beside[k] = (largest(increment), largest(size));
            }
            if let Some(verdict) = monitor.see(largest(increment), largest(size), beside) {
                return verdict;
            }
        }
    }
}

#[inline(always)]
fn splat(value: f64) -> Points {
    Lanes([value; 4])
}

#[inline(always)]
fn largest(four: Points) -> f64 {
    let both = |x: f64, y: f64| if x > y || x.is_nan() { x } else { y };
    both(both(four.0[0], four.0[1]), both(four.0[2], four.0[3]))
}
