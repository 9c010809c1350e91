//! Adjoint of an element: products of a row vector with the derivative of an element, and derivatives by many
//! parameters at once (T-127).
//!
//! Where the fixed-point iteration of the element contracts, the transposed iteration contracts as well, and no tangent
//! has to be set up and factored. With the adjoint seeds φ of the forces at the points of a collocated element,
//!
//! ```text
//! φ_l = h b_l λ_p + h Σ_i A_il μ_i ,     Γ_l = (L_qq + Q_q)ᵀ φ_l − L_vqᵀ μ_l ,
//! L_vv μ_j = h b_j λ_q + h Σ_l A_lj Γ_l + (L_qv + Q_v)ᵀ φ_j ;     λ_p += Σ μ_i ,     λ_q += Σ Γ_l .                  (T-150)
//! ```

use crate::condense::{Direction, add_multiple};
use crate::error::StepError;
use crate::inside::{InsideLoss, Seeds};
use crate::lu::Block;
use crate::model::{First, Form, Model};
use crate::phase_form::PhaseForm;
use crate::real::Real;
use crate::tape::{Places, Tape};
use crate::velocity_form::{PointDerivatives, VelocityForm};
use alloc::vec::Vec;

/// Whether all directions are parameters, and so many of them that it pays to differentiate by all parameters at once.
pub(crate) fn are_parameters<M: Model<N>, const N: usize>(
    model: &M,
    directions: &[Direction],
) -> bool {
    /// With fewer directions, dual numbers are cheaper.
    const MIN: usize = 4;
    let is_one = |direction: &Direction| {
        let moves = [direction.time, direction.length, direction.damping] != [0.0; 3];
        let index = direction.parameter.and_then(|one| one.any(model));
        !moves && index.is_some_and(|index| index < model.parameters())
    };
    M::CONSTRAINTS.is_empty() && directions.len() >= MIN && directions.iter().all(is_one)
}

/// The adjoint of elements: the accumulated derivatives by all parameters, and the memory that their computation needs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Backwards<const N: usize> {
    tape: Tape,
    points: Points<N>,
}

impl<const N: usize> Backwards<N> {
    /// Sets the sums of this many parameters to zero.
    pub(crate) fn begin(&mut self, parameters: usize) {
        self.tape.begin(parameters);
    }

    /// Adds the derivatives of an element in phase space, given μ of (T-127).
    pub(crate) fn of_phase<M: Model<N>>(
        &mut self,
        equations: &PhaseForm<'_, M, N>,
        x: &[f64],
        mu: &[f64],
    ) {
        if self.tape.parameters() == 0 {
            return;
        }
        let points = equations.scheme.points();
        let (forces, velocities) = mu.as_chunks::<N>().0.split_at(points);
        let mut places = Places::NONE;
        for k in 0..points {
            let (t, q, p) = equations.place(k, x);
            let weights = First {
                z: velocities[k],
                q: forces[k].map(|weight| -weight),
                force: forces[k],
            };
            places.push((t, &q, &p), &weights);
            if places.is_full() || k + 1 == points {
                (self.tape).take_derivatives(equations.model, &mut places);
            }
        }
    }

    /// Adds the derivatives of an element in velocity form, given the adjoint λ of the momenta at its end and, if there
    /// are any, adjoint seeds of the forces at its points.
    pub(crate) fn of_velocities<M: Model<N>>(
        &mut self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        (lambda, mu): (&[f64; N], &[f64]),
        seeds: &[f64],
    ) -> Result<(), StepError> {
        if self.tape.parameters() == 0 {
            return Ok(());
        }
        let (rates, mu) = (x.as_chunks::<N>().0, mu.as_chunks::<N>().0);
        let (scheme, h) = (equations.scheme, equations.span.h);
        let points = scheme.points();
        let mut places = Places::NONE;
        for l in 0..points {
            let (mut momentum, mut force) = ([0.0; N], [0.0; N]);
            for a in 0..N {
                force[a] = h * scheme.weights[l] * lambda[a];
                for (i, mu) in mu.iter().enumerate() {
                    momentum[a] -= scheme.momentum[i * points + l] * mu[a];
                    force[a] += h * scheme.force[i * points + l] * mu[a];
                }
            }
            if let Some(seed) = seeds.as_chunks::<N>().0.get(l) {
                add_multiple(&mut force, 1.0, seed);
            }
            let (t, q, v) = equations.place(l, rates);
            let (z, weights) = match M::FORM {
                Form::Lagrangian => {
                    let weights = First {
                        z: momentum,
                        q: force,
                        force,
                    };
                    (v, weights)
                }
                // At fixed v the momentum moves: H_pp δp = −H_pa, and with it H_q and Q.
                Form::Hamiltonian => {
                    let mut point = PointDerivatives::ZERO;
                    equations.derivatives(l, rates, &mut point)?;
                    let second = &point.second;
                    let mut of_z = [0.0; N];
                    for a in 0..N {
                        for b in 0..N {
                            of_z[b] -= momentum[a] * second.zz[a][b]
                                + force[a] * (second.zq[b][a] + second.force_z[a][b]);
                        }
                    }
                    let weights = First {
                        z: of_z,
                        q: force.map(|weight| -weight),
                        force,
                    };
                    (point.p, weights)
                }
            };
            places.push((t, &q, &z), &weights);
            if places.is_full() || l + 1 == points {
                (self.tape).take_derivatives(equations.model, &mut places);
            }
        }
        Ok(())
    }

    /// Adds the accumulated derivatives to the sums of the directions.
    pub(crate) fn add_to<M: Model<N>>(
        &self,
        model: &M,
        directions: &[Direction],
        by_direction: &mut [f64],
    ) {
        for (direction, sum) in directions.iter().zip(by_direction) {
            let index = direction.parameter.and_then(|one| one.any(model));
            *sum += index.map_or(0.0, |index| self.tape.sum(index));
        }
    }
}

/// The derivatives at the points that (T-150) needs; an empty list stands for derivatives that are all zero.
#[derive(Clone, Debug, Default)]
struct Points<const N: usize> {
    force_q: Vec<[[f64; N]; N]>,
    force_v: Vec<[[f64; N]; N]>,
    momentum_q: Vec<[[f64; N]; N]>,
    /// The factored mass matrices: a single one where the mass matrix is constant.
    masses: Vec<Mass<N>>,
    /// The units in which convergence is also measured; `None` where the masses are of similar size.
    units: Option<[Units; N]>,
    mu: Vec<[f64; N]>,
    /// The derivatives of the loss by quantities inside the element.
    seeds: Seeds,
    pulled: Vec<[f64; N]>,
    rows: Vec<[f64; N]>,
}

/// L_vv in the form in which systems with it are solved.
#[derive(Clone, Debug)]
enum Mass<const N: usize> {
    Diagonal([f64; N]),
    Full(Block<N>),
}

impl<const N: usize> Mass<N> {
    /// `None` if the matrix is singular.
    fn of(matrix: &[[f64; N]; N]) -> Option<Self> {
        let mut rows = matrix.iter().enumerate();
        let is_diagonal = rows.all(|(a, row)| {
            let mut entries = row.iter().enumerate();
            entries.all(|(b, entry)| (*entry == 0.0) != (a == b))
        });
        if !is_diagonal {
            return Block::of(matrix).ok().map(Self::Full);
        }
        let mut diagonal = [0.0; N];
        for a in 0..N {
            diagonal[a] = matrix[a][a];
        }
        Some(Self::Diagonal(diagonal))
    }

    #[inline(always)]
    fn solve(&self, row: &mut [f64; N]) {
        match self {
            Self::Diagonal(diagonal) => {
                for a in 0..N {
                    row[a] /= diagonal[a];
                }
            }
            Self::Full(block) => block.solve(row),
        }
    }
}

/// sum += matrixᵀ row
#[inline(always)]
fn add_transposed<const N: usize>(matrix: &[[f64; N]; N], row: &[f64; N], sum: &mut [f64; N]) {
    for a in 0..N {
        add_multiple(sum, row[a], &matrix[a]);
    }
}

impl<const N: usize> Points<N> {
    /// Evaluates the derivatives at the points of an element; false if a mass matrix is singular.
    fn set<M: Model<N>>(
        &mut self,
        equations: &mut VelocityForm<'_, M, N>,
        rates: &[[f64; N]],
    ) -> Result<bool, StepError> {
        let points = equations.scheme.points();
        for matrices in [&mut self.force_q, &mut self.force_v, &mut self.momentum_q] {
            matrices.clear();
        }
        self.masses.clear();
        let mut point = PointDerivatives::ZERO;
        for l in 0..points {
            equations.derivatives(l, rates, &mut point)?;
            let second = &point.second;
            self.force_q.push(second.qq);
            if M::FACTS.forced {
                let sum = self.force_q[l].as_flattened_mut();
                add_multiple(sum, 1.0, second.force_q.as_flattened());
            }
            if has_velocities::<M, N>() {
                let mut force_v = second.force_z;
                for a in 0..N {
                    for b in 0..N {
                        force_v[a][b] += second.zq[b][a];
                    }
                }
                self.force_v.push(force_v);
            }
            if !M::FACTS.separable {
                self.momentum_q.push(second.zq);
            }
            if self.masses.is_empty() {
                let mut masses = [0.0; N];
                for a in 0..N {
                    masses[a] = second.zz[a][a];
                }
                let largest = largest_of_unlike(&masses);
                self.units = largest.map(|largest| masses.map(|mass| units(mass, largest)));
            }
            if self.masses.is_empty() || !M::FACTS.constant_mass {
                let Some(mass) = Mass::of(&second.zz) else {
                    return Ok(false);
                };
                self.masses.push(mass);
            }
        }
        for rows in [&mut self.mu, &mut self.pulled, &mut self.rows] {
            rows.clear();
            rows.resize(points, [0.0; N]);
        }
        Ok(true)
    }

    /// Solves (T-150) for μ by iteration and adds its contributions to λ; false where the iteration does not contract.
    fn iterate<M: Model<N>>(&mut self, equations: &VelocityForm<'_, M, N>, lambda: &[f64]) -> bool {
        let iteration = Iteration {
            points: self,
            equations,
            lambda,
        };
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let Some(isa) = pulp::x86::V3::try_new() {
            return isa.vectorize(iteration);
        }
        iteration.run()
    }
}

/// √m and m of a coordinate, relative to the largest mass. For a loss that depends on coordinates only, m μ is of
/// similar size for all coordinates, whereas μ of a heavy body is small beside that of a light one.
pub(crate) type Units = [f64; 2];

/// The largest of several masses, if they differ much in size.
pub(crate) fn largest_of_unlike(masses: &[f64]) -> Option<f64> {
    /// Up to this ratio, different masses cost no more than about one digit.
    const ALIKE: f64 = 16.0;

    let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
    for mass in masses {
        least = least.min(mass.abs());
        largest = largest.max(mass.abs());
    }
    let is_unlike = least > 0.0 && largest.is_finite() && largest > ALIKE * least;
    is_unlike.then_some(largest)
}

/// The units that belong to a mass.
pub(crate) fn units(mass: f64, largest: f64) -> Units {
    let part = mass.abs() / largest;
    [Real::sqrt(part), part]
}

/// Monitors the convergence of the iteration of (T-150).
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdjointMonitor {
    before: f64,
    /// The last increments in the other [`Units`]; `None` once they have stopped shrinking there.
    others: [Option<f64>; 2],
    has_converged: bool,
}

impl Default for AdjointMonitor {
    fn default() -> Self {
        Self {
            before: f64::INFINITY,
            others: [Some(f64::INFINITY); 2],
            has_converged: false,
        }
    }
}

impl AdjointMonitor {
    /// Increments of this size, relative to μ, are rounding errors.
    const ROUNDING: f64 = 1e-16;
    /// Each increment must be at most this fraction of the one before; otherwise LU factors of the tangent are cheaper.
    const CONTRACTION: f64 = 0.2;

    /// Takes the largest increment of μ and the largest μ, and the same pair in the other [`Units`] (zeros where masses
    /// are of similar size). Returns whether the iteration has converged, or `None` while that is undecided. The other
    /// units can only prolong the iteration.
    #[inline(always)]
    pub(crate) fn see(
        &mut self,
        increment: f64,
        size: f64,
        others: [(f64, f64); 2],
    ) -> Option<bool> {
        for k in 0..2 {
            let (increment, size) = others[k];
            if let Some(before) = self.others[k] {
                let is_left = increment > Self::ROUNDING * size;
                let shrinks = increment <= Self::CONTRACTION * before;
                self.others[k] = (is_left && shrinks).then_some(increment);
            }
        }
        if !self.has_converged {
            match self.judge(increment, size) {
                Some(true) => self.has_converged = true,
                other => return other,
            }
        }
        (self.others == [None; 2]).then_some(true)
    }

    #[inline(always)]
    fn judge(&mut self, increment: f64, size: f64) -> Option<bool> {
        if increment <= Self::ROUNDING * size {
            return Some(true);
        }
        if !(increment <= Self::CONTRACTION * self.before) {
            // Rounding errors do not shrink further.
            return Some(increment <= 64.0 * Self::ROUNDING * size);
        }
        self.before = increment;
        None
    }
}

/// The iteration of (T-150).
struct Iteration<'a, 'e, M, const N: usize> {
    points: &'a mut Points<N>,
    equations: &'a VelocityForm<'e, M, N>,
    lambda: &'a [f64],
}

/// Compiled for the widest registers of the processor, with the same roundings.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
impl<M: Model<N>, const N: usize> pulp::NullaryFnOnce for Iteration<'_, '_, M, N> {
    type Output = bool;
    #[inline(always)]
    fn call(self) -> bool {
        self.run()
    }
}

impl<M: Model<N>, const N: usize> Iteration<'_, '_, M, N> {
    // Plain loops instead of closures: a closure would be compiled for the instruction set of the crate.
    #[inline(always)]
    fn run(self) -> bool {
        let Points {
            force_q,
            force_v,
            momentum_q,
            masses,
            units,
            mu,
            seeds,
            pulled,
            rows,
        } = self.points;
        let (scheme, h) = (&self.equations.scheme, self.equations.span.h);
        let points = scheme.points();
        let (of_p, of_q) = self.lambda.split_at(N);
        let mut monitor = AdjointMonitor::default();
        loop {
            for l in 0..points {
                let mut seed = [0.0; N];
                for a in 0..N {
                    seed[a] = h * scheme.weights[l] * of_p[a];
                    rows[l][a] = h * scheme.advance[l] * of_q[a];
                }
                if !seeds.is_empty() {
                    add_multiple(&mut seed, 1.0, &seeds.forces[l * N..]);
                    add_multiple(&mut rows[l], 1.0, &seeds.rates[l * N..]);
                }
                for i in 0..points {
                    add_multiple(&mut seed, h * scheme.force[i * points + l], &mu[i]);
                }
                pulled[l] = [0.0; N];
                add_transposed(&force_q[l], &seed, &mut pulled[l]);
                if const { has_velocities::<M, N>() } {
                    add_transposed(&force_v[l], &seed, &mut rows[l]);
                }
                if const { !M::FACTS.separable } {
                    let mut negative = mu[l];
                    for a in 0..N {
                        negative[a] = -negative[a];
                    }
                    add_transposed(&momentum_q[l], &negative, &mut pulled[l]);
                }
            }
            let (mut increment, mut size) = (0.0_f64, 0.0_f64);
            let mut others = [(0.0_f64, 0.0_f64); 2];
            for j in 0..points {
                let mut row = rows[j];
                for l in 0..points {
                    add_multiple(&mut row, h * scheme.position[l * points + j], &pulled[l]);
                }
                masses[j.min(masses.len() - 1)].solve(&mut row);
                for a in 0..N {
                    let change = (row[a] - mu[j][a]).abs();
                    // `f64::max` would ignore a NaN.
                    increment = if change > increment || change.is_nan() {
                        change
                    } else {
                        increment
                    };
                    size = size.max(row[a].abs());
                    if let Some(units) = units {
                        for k in 0..2 {
                            let (increment, size) = &mut others[k];
                            *increment = increment.max(units[a][k] * change);
                            *size = size.max(units[a][k] * row[a].abs());
                        }
                    }
                    mu[j][a] = row[a];
                }
            }
            if let Some(verdict) = monitor.see(increment, size, others) {
                return verdict;
            }
        }
    }
}

/// Whether forces depend on velocities.
const fn has_velocities<M: Model<N>, const N: usize>() -> bool {
    M::FACTS.forced || !M::FACTS.separable
}

impl<const N: usize> Backwards<N> {
    /// Computes μ and the new λ by iteration; false, with λ unchanged, where the iteration does not contract.
    pub(crate) fn try_iteration<M: Model<N>>(
        &mut self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        (inside, lambda): (Option<&InsideLoss>, &mut [f64]),
    ) -> Result<bool, StepError> {
        if M::FORM != Form::Lagrangian
            || !equations.scheme.collocated
            || !M::CONSTRAINTS.is_empty()
            || !self.points.set(equations, x.as_chunks::<N>().0)?
        {
            return Ok(false);
        }
        self.points.seeds = Seeds::of(inside, &equations.scheme, equations.span.h);
        if !self.points.iterate(equations, lambda) {
            return Ok(false);
        }
        let mut of_p = [0.0; N];
        of_p.copy_from_slice(&lambda[..N]);
        for (mu, pulled) in self.points.mu.iter().zip(&self.points.pulled) {
            for a in 0..N {
                lambda[a] += mu[a];
                lambda[N + a] += pulled[a];
            }
        }
        let mu = core::mem::take(&mut self.points.mu);
        let seeds = core::mem::take(&mut self.points.seeds);
        self.of_velocities(equations, x, (&of_p, mu.as_flattened()), &seeds.forces)?;
        self.points.mu = mu;
        Ok(true)
    }
}
