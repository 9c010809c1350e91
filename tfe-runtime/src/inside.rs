//! The derivatives of the polynomial of an element as linear functions of its start and of directions, and the adjoint
//! of this map: how the derivatives of a loss by the polynomial enter those by rates and forces (T-154).
//!
//! With the Legendre coefficients C of dq/dτ and dp/dτ, which are linear in the rates ν and the forces F at the points,
//!
//! ```text
//! δy(τ) = δy₀ + Σ_m ∫₀^τ P_m δC_m ,     δC^q_m = h Σ_j R_mj δν_j ,     δC^p_m = h Σ_l R*_ml δF_l ,
//! ```
//!
//! and a loss with derivatives S by C adds h Σ_m R_mj S^q_m to what it has of ν_j, and h Σ_m R*_ml S^p_m to what it has
//! of F_l.

use crate::basis::{MAX_NODES, legendre_integrals};
use crate::condense::{Direction, add_multiple};
use crate::constrained::rows::dot;
use crate::dense::DenseElement;
use crate::error::StepError;
use crate::model::{Model, State};
use crate::scheme::SchemeRef;
use crate::velocity_form::{PointDerivatives, PointTangent, VelocityForm, add_row};
use alloc::vec;
use alloc::vec::Vec;

/// The derivatives of the polynomial of an element, or of one piece of an element that was cut. There is a column for
/// each component of the start, ordered (p, q), and for each direction.
///
/// Times inside move with the ends: the derivatives are taken at a fixed fraction of the piece.
#[derive(Clone, Debug, Default)]
pub struct InsideSlopes {
    /// Derivatives of the state at the start of the piece; 2N rows, ordered (p, q).
    pub start: Vec<f64>,
    /// Derivatives of the Legendre coefficients of dq/dτ, N rows for each coefficient, then of those of dp/dτ.
    pub coefficients: Vec<f64>,
    /// Derivatives of the times of its start and its end, if kinks move them; otherwise empty.
    pub ends: [Vec<f64>; 2],
}

impl InsideSlopes {
    /// Adds the derivatives of a loss of the polynomial: one number for each column.
    pub fn add_to(&self, loss: &InsideLoss, sums: &mut [f64]) {
        let matrices = [
            (&loss.start, &self.start),
            (&loss.coefficients, &self.coefficients),
        ];
        for (weights, rows) in matrices {
            for (weight, row) in weights.iter().zip(rows.chunks_exact(sums.len().max(1))) {
                add_multiple(sums, *weight, row);
            }
        }
        for (weight, row) in loss.ends.iter().zip(&self.ends) {
            add_multiple(sums, *weight, row);
        }
    }
}

/// The derivatives of a loss by the polynomial of an element, or of one piece of an element that was cut, with n
/// coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct InsideLoss {
    /// By the state at the start, ordered (p, q).
    pub start: Vec<f64>,
    /// By the Legendre coefficients of dq/dτ, a row of n for each, then by those of dp/dτ.
    pub coefficients: Vec<f64>,
    /// By the times of the start and the end, at a fixed polynomial; used where kinks move them.
    pub ends: [f64; 2],
}

impl InsideLoss {
    /// Zero derivatives, for a polynomial of n coordinates and of this degree.
    #[must_use]
    pub fn none(n: usize, degree: usize) -> Self {
        Self {
            start: vec![0.0; 2 * n],
            coefficients: vec![0.0; 2 * degree * n],
            ends: [0.0; 2],
        }
    }

    /// Adds the derivatives of the loss by the state at τ ∈ [0, 1].
    pub fn add(&mut self, tau: f64, (by_q, by_p): (&[f64], &[f64])) {
        let n = self.start.len() / 2;
        let half = self.coefficients.len() / 2;
        let mut integrals = [0.0; MAX_NODES];
        legendre_integrals(tau, &mut integrals);
        let (start_p, start_q) = self.start.split_at_mut(n);
        let (q, p) = self.coefficients.split_at_mut(half);
        for (start, coefficients, by) in [(start_q, q, by_q), (start_p, p, by_p)] {
            add_multiple(start, 1.0, by);
            for (row, weight) in coefficients.chunks_exact_mut(n.max(1)).zip(integrals) {
                add_multiple(row, weight, by);
            }
        }
    }

    /// The derivatives of the loss by the unknown rates and by the forces at the points of an element of length h, a
    /// row of n for each.
    pub(crate) fn seeds(&self, scheme: &SchemeRef<'_>, h: f64) -> Seeds {
        let (q, p) = self.coefficients.split_at(self.coefficients.len() / 2);
        let n = self.start.len() / 2;
        let pulled = |matrix: &[f64], coefficients: &[f64], count: usize| {
            let mut rows = vec![0.0; count * n];
            let coefficients = coefficients.chunks_exact(n.max(1));
            for (weights, coefficient) in matrix.chunks_exact(count).zip(coefficients) {
                for (row, weight) in rows.chunks_exact_mut(n).zip(weights) {
                    add_multiple(row, h * weight, coefficient);
                }
            }
            rows
        };
        Seeds {
            rates: pulled(scheme.rate, q, scheme.unknowns()),
            forces: pulled(scheme.force_rate, p, scheme.points()),
        }
    }
}

/// The derivatives of a loss by the unknowns inside an element.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seeds {
    /// By the unknown rates, a row of n for each; in phase space by the velocities at the stages. Empty if the loss
    /// does not depend on the inside.
    pub(crate) rates: Vec<f64>,
    /// By the forces at the points, a row of n for each.
    pub(crate) forces: Vec<f64>,
}

impl Seeds {
    /// The derivatives for an element; empty without a loss.
    pub(crate) fn of(inside: Option<&InsideLoss>, scheme: &SchemeRef<'_>, h: f64) -> Self {
        inside.map_or_else(Self::default, |inside| inside.seeds(scheme, h))
    }

    /// Whether the loss does not depend on the inside.
    pub(crate) fn is_empty(&self) -> bool {
        self.rates.is_empty()
    }

    /// Adds the derivatives by the forces at a point.
    #[cfg(feature = "sparse")]
    pub(crate) fn add_forces(&self, point: usize, forces: &mut [f64]) {
        let n = forces.len();
        if !self.is_empty() {
            add_multiple(forces, 1.0, &self.forces[point * n..]);
        }
    }

    /// Adds these derivatives to λᵀ ∂(end)/∂(interior), in phase space, and adds their derivatives by the directions at
    /// a fixed interior.
    pub(crate) fn add_to_phase(
        &self,
        x: &[f64],
        (directions, h): (&[Direction], f64),
        by_direction: &mut [f64],
        weights: &mut [f64],
    ) {
        let all = self.forces.iter().chain(&self.rates);
        for ((weight, seed), unknown) in weights.iter_mut().zip(all).zip(x) {
            *weight += seed;
            for (sum, direction) in by_direction.iter_mut().zip(directions) {
                *sum += direction.length / h * seed * unknown;
            }
        }
    }

    /// The same in velocity form, where forces are functions of the interior, of the start and of the directions.
    pub(crate) fn add_to_velocities<M: Model<N>, const N: usize>(
        &self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        (lambda, by_direction, weights): (&mut [f64], &mut [f64], &mut [f64]),
    ) -> Result<(), StepError> {
        let (rates, h) = (x.as_chunks::<N>().0, equations.span.h);
        for ((weight, seed), rate) in weights.iter_mut().zip(&self.rates).zip(x) {
            *weight += seed;
            for (sum, direction) in by_direction.iter_mut().zip(directions) {
                *sum += direction.length / h * seed * rate;
            }
        }
        let mut point = PointDerivatives::ZERO;
        for (l, seed) in self.forces.as_chunks::<N>().0.iter().enumerate() {
            equations.derivatives(l, rates, &mut point)?;
            let by = PointTangent::of(h, &point.second);
            let by_q = force_by_q(&point);
            for a in 0..N {
                add_row(&equations.scheme, l, &by, a, 0.0, seed[a], weights);
                add_multiple(&mut lambda[N..], seed[a], &by_q[a]);
            }
            for (sum, direction) in by_direction.iter_mut().zip(directions) {
                let (_, of_force) = equations.along(l, rates, &point, &by_q, direction);
                *sum += dot(seed, &of_force) + direction.length / h * dot(seed, &point.force);
            }
        }
        Ok(())
    }
}

/// L_qq + Q_q
fn force_by_q<const N: usize>(point: &PointDerivatives<N>) -> [[f64; N]; N] {
    let mut by_q = point.second.qq;
    for a in 0..N {
        add_multiple(&mut by_q[a], 1.0, &point.second.force_q[a]);
    }
    by_q
}

/// The solved right-hand sides of an element, from which the derivatives of its polynomials follow.
pub(crate) struct Columns<'a, const N: usize> {
    pub(crate) scheme: SchemeRef<'a>,
    pub(crate) h: f64,
    pub(crate) directions: &'a [Direction],
    /// The solutions: a row for each interior unknown.
    pub(crate) sides: &'a [f64],
}

/// Adds Σ weight · row to N rows; the terms begin at a first row and are N rows apart.
fn add_rows<const N: usize>(
    sums: &mut [f64],
    (weights, factor): (&[f64], f64),
    (rows, columns): (&[f64], usize),
) {
    let size = N * columns;
    for (weight, rows) in weights.iter().zip(rows.chunks_exact(size)) {
        add_multiple(&mut sums[..size], factor * weight, rows);
    }
}

impl<const N: usize> Columns<'_, N> {
    fn count(&self) -> usize {
        2 * N + self.directions.len()
    }

    /// The solutions, corrected for a change of the length of the element: h Σ weight · (these) is the derivative of h
    /// Σ weight · unknowns.
    fn stretched(&self, x: &[f64]) -> Vec<f64> {
        let (columns, mut sides) = (self.count(), self.sides[..x.len() * self.count()].to_vec());
        for (k, direction) in self.directions.iter().enumerate() {
            if direction.length != 0.0 {
                for (row, x) in sides.chunks_exact_mut(columns).zip(x) {
                    row[2 * N + k] += direction.length / self.h * x;
                }
            }
        }
        sides
    }

    /// Appends the rows of coefficients h Σ weight · rows.
    fn projected(&self, matrix: &[f64], rows: &[f64], coefficients: &mut Vec<f64>) {
        let columns = self.count();
        let points = rows.len() / (N * columns);
        for weights in matrix.chunks_exact(points) {
            let first = coefficients.len();
            coefficients.resize(first + N * columns, 0.0);
            let sums = &mut coefficients[first..];
            add_rows::<N>(sums, (weights, self.h), (rows, columns));
        }
    }

    fn room(&self) -> Vec<f64> {
        Vec::with_capacity(2 * self.scheme.rates() * N * self.count())
    }

    /// The derivatives in phase space.
    pub(crate) fn of_phase(&self, x: &[f64]) -> Vec<f64> {
        let rows = self.stretched(x);
        let (forces, rates) = rows.split_at(rows.len() / 2);
        let mut coefficients = self.room();
        self.projected(self.scheme.rate, rates, &mut coefficients);
        self.projected(self.scheme.force_rate, forces, &mut coefficients);
        coefficients
    }

    /// The derivatives in velocity form.
    pub(crate) fn of_velocities<M: Model<N>>(
        &self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
    ) -> Result<Vec<f64>, StepError> {
        let rates = self.stretched(x);
        let forces = self.at_points(equations, x, Wanted::Forces)?;
        let mut coefficients = self.room();
        self.projected(self.scheme.rate, &rates, &mut coefficients);
        self.projected(self.scheme.force_rate, &forces, &mut coefficients);
        Ok(coefficients)
    }

    /// The derivatives with constraints, where the polynomial of the momenta passes through those at the points and at
    /// the ends, whose derivatives are given.
    pub(crate) fn of_constrained<M: Model<N>>(
        &self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        ends: &[f64],
    ) -> Result<Vec<f64>, StepError> {
        let columns = self.count();
        let x = &x[..self.scheme.unknowns() * N];
        let momenta = self.at_points(equations, x, Wanted::Momenta)?;
        let mut coefficients = self.room();
        self.projected(self.scheme.rate, &self.stretched(x), &mut coefficients);
        let first = coefficients.len();
        coefficients.resize(2 * first, 0.0);
        // The map is linear in the momenta: column by column.
        let none = vec![[0.0; N]; self.scheme.unknowns()];
        let mut of_column = vec![[0.0; N]; self.scheme.points()];
        for column in 0..columns {
            let (mut start, mut end) = (State::ZERO, State::ZERO);
            for a in 0..N {
                start.p[a] = if column == a { 1.0 } else { 0.0 };
                end.p[a] = ends[a * columns + column];
                for (l, momentum) in of_column.iter_mut().enumerate() {
                    momentum[a] = momenta[(l * N + a) * columns + column];
                }
            }
            let (times, ends) = ((0.0, self.h), (&start, &end));
            let scheme = &self.scheme;
            let slopes = DenseElement::constrained(scheme, times, self.h, ends, &none, &of_column);
            let slopes = slopes.coefficients().as_flattened();
            for (row, slope) in slopes.iter().enumerate().skip(slopes.len() / 2) {
                coefficients[row * columns + column] = *slope;
            }
        }
        Ok(coefficients)
    }

    /// The derivatives of the momenta at the points, or of the forces, corrected for a change of the length of the
    /// element: N rows for each point, with all columns.
    fn at_points<M: Model<N>>(
        &self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        wanted: Wanted,
    ) -> Result<Vec<f64>, StepError> {
        let (points, columns) = (self.scheme.points(), self.count());
        let (unknowns, size) = (self.scheme.unknowns(), N * columns);
        let rates = x.as_chunks::<N>().0;
        let mut all = vec![0.0; points * size];
        let (mut by_q, mut by_v) = (vec![0.0; size], vec![0.0; size]);
        let mut point = PointDerivatives::ZERO;
        for (l, slopes) in all.chunks_exact_mut(size).enumerate() {
            equations.derivatives(l, rates, &mut point)?;
            // The effect of the directions at fixed unknowns is in `along`.
            let row = l * unknowns..(l + 1) * unknowns;
            by_q.fill(0.0);
            for a in 0..N {
                by_q[a * columns + N + a] = 1.0;
            }
            let sides = (self.sides, columns);
            let position = &self.scheme.position[row.clone()];
            add_rows::<N>(&mut by_q, (position, self.h), sides);
            if self.scheme.collocated {
                by_v.copy_from_slice(&self.sides[l * size..(l + 1) * size]);
            } else {
                by_v.fill(0.0);
                add_rows::<N>(&mut by_v, (&self.scheme.velocity[row], 1.0), sides);
            }
            let force_q = force_by_q(&point);
            let second = &point.second;
            for a in 0..N {
                let slopes = &mut slopes[a * columns..(a + 1) * columns];
                for b in 0..N {
                    let (of_q, of_v) = match wanted {
                        Wanted::Momenta => (second.zq[a][b], second.zz[a][b]),
                        Wanted::Forces => (force_q[a][b], second.force_z[a][b] + second.zq[b][a]),
                    };
                    for (weight, rows) in [(of_q, &by_q), (of_v, &by_v)] {
                        if weight != 0.0 {
                            add_multiple(slopes, weight, &rows[b * columns..(b + 1) * columns]);
                        }
                    }
                }
            }
            for (k, direction) in self.directions.iter().enumerate() {
                let (of_momentum, of_force) =
                    equations.along(l, rates, &point, &force_q, direction);
                for a in 0..N {
                    slopes[a * columns + 2 * N + k] += match wanted {
                        Wanted::Momenta => of_momentum[a],
                        Wanted::Forces => of_force[a] + direction.length / self.h * point.force[a],
                    };
                }
            }
        }
        Ok(all)
    }
}

/// Which derivatives at the points are computed.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    Momenta,
    Forces,
}
