//! The velocity that belongs to a momentum at one instant, under constraints, by a sparse factorisation (T-74).

use super::blocked::{Blocked, Place};
use super::model::{Gradient, Model};
use super::pattern::Pattern;
use super::rows::Rows;
use crate::constrained::node::{MAX, is_settled};
use crate::error::{ConstraintError, LegendreError, StepError};
use crate::legendre::largest;
use alloc::vec;
use alloc::vec::Vec;

/// The number of times a step is halved.
const MAX_HALVINGS: u32 = 20;

/// How accurately a regular mass matrix has to reproduce a vector: if it is less accurate, the constraints determine
/// the velocities better than the momenta do.
const REGULAR: f64 = 1e-6;

/// Solves, for z = v of a Lagrangian or z = p of a Hamiltonian,
///
/// ```text
/// ∂E/∂z (q, z, t) + Aᵀη = wanted ,     A z + a = 0 .
/// ```
#[derive(Clone, Debug)]
pub(super) struct Node {
    pattern: Pattern,
    matrix: Blocked,
    masses: Vec<Place>,
    rows: Vec<(Place, Place)>,
    derivatives: Vec<f64>,
    /// ∂E/∂z at the solution.
    pub(super) slope: Vec<f64>,
    unused: [Vec<f64>; 2],
    rate: Vec<f64>,
    vector: Vec<f64>,
}

impl Node {
    /// Finds the sparsity pattern and its ordering; `None` where memory does not suffice.
    pub(super) fn new<M: Model>(model: &M, rows: &Rows) -> Option<Self> {
        Self::of(Pattern::of_mass(model), model.len(), rows)
    }

    fn of(pattern: Pattern, n: usize, rows: &Rows) -> Option<Self> {
        let m = rows.phi.len();
        let masses = || pattern.places().iter().map(|(_, a, b)| (*a, *b));
        let borders = rows.places().flat_map(|(c, a)| [(n + c, a), (a, n + c)]);
        let places: Vec<(usize, usize)> = masses().chain(borders).collect();
        let matrix = Blocked::new(n + m, 1, &places)?.bordered(n);
        Some(Self {
            masses: masses().map(|(a, b)| matrix.place(a, b)).collect(),
            rows: rows
                .places()
                .map(|(c, a)| (matrix.place(n + c, a), matrix.place(a, n + c)))
                .collect(),
            derivatives: vec![0.0; pattern.places().len()],
            pattern,
            matrix,
            slope: vec![0.0; n],
            unused: [vec![0.0; n], vec![0.0; n]],
            rate: vec![0.0; m],
            vector: vec![0.0; n + m],
        })
    }

    /// Moves `z` from a guess to the solution. The rows have been evaluated at (t, q).
    ///
    /// # Errors
    /// [`StepError`] if there is no solution.
    pub(super) fn solve<M: Model>(
        &mut self,
        model: &M,
        (t, q): (f64, &[f64]),
        wanted: &[f64],
        rows: &Rows,
        z: &mut [f64],
    ) -> Result<(), StepError> {
        let n = z.len();
        let mut last = f64::INFINITY;
        for _ in 0..MAX {
            self.slope(model, t, q, z);
            self.factor(model, (t, q, z), rows)?;
            for a in 0..n {
                self.vector[a] = wanted[a] - self.slope[a];
            }
            rows.rate(z, &mut self.rate);
            for (entry, rate) in self.vector[n..].iter_mut().zip(&self.rate) {
                *entry = -rate;
            }
            let is_posed = largest(&self.vector).is_finite();
            // The multiplier is solved for anew in each iteration: it enters linearly.
            self.matrix.solve(&mut self.vector);
            if is_posed && !rows.phi.is_empty() && !largest(&self.vector).is_finite() {
                return Err(ConstraintError::DependentRows.into());
            }
            let step = largest(&self.vector[..n]);
            self.walk(model, (t, q), wanted, z);
            let scale = largest(z);
            if !(step + scale).is_finite() {
                return Err(StepError::NonFinite);
            }
            if is_settled(step, last, scale) || (M::FACTS.quadratic_in_z && last.is_finite()) {
                self.slope(model, t, q, z);
                return Ok(());
            }
            last = step;
        }
        Err(LegendreError::Stalled {
            iterations: MAX,
            residual: last,
        }
        .into())
    }

    /// Factors the matrix at one instant.
    fn factor<M: Model>(
        &mut self,
        model: &M,
        (t, q, z): (f64, &[f64], &[f64]),
        rows: &Rows,
    ) -> Result<(), StepError> {
        let mut entries = self.pattern.scatter(&mut self.derivatives);
        model.mass(t, q, z, &mut entries);
        self.matrix.values.fill(0.0);
        for (place, value) in self.masses.iter().zip(&self.derivatives) {
            self.matrix.values[place.first] = *value;
        }
        for ((place, transposed), value) in self.rows.iter().zip(&rows.values) {
            self.matrix.values[place.first] = *value;
            self.matrix.values[transposed.first] = *value;
        }
        self.matrix.factor().map_err(|error| match error {
            StepError::NonFinite => error,
            _ if rows.phi.is_empty() => LegendreError::Singular { coordinate: 0 }.into(),
            _ => ConstraintError::SingularMass.into(),
        })
    }

    /// Evaluates and factors the matrix at one instant.
    ///
    /// # Errors
    /// [`StepError`] where it is singular.
    pub(super) fn linearised<M: Model>(
        mut self,
        model: &M,
        at: (f64, &[f64], &[f64]),
        rows: &Rows,
    ) -> Result<Blocked, StepError> {
        self.factor(model, at, rows)?;
        Ok(self.matrix)
    }

    /// Solves the linear equations at one instant, with Aᵀ in the columns of the multipliers.
    ///
    /// # Errors
    /// [`StepError`] where the matrix is singular or a number is not finite.
    pub(super) fn solve_linear<M: Model>(
        &mut self,
        model: &M,
        at: (f64, &[f64], &[f64]),
        rows: &Rows,
        sides: impl Iterator<Item = f64>,
    ) -> Result<&[f64], StepError> {
        self.factor(model, at, rows)?;
        for (entry, side) in self.vector.iter_mut().zip(sides) {
            *entry = side;
        }
        self.matrix.solve(&mut self.vector);
        match self.vector.iter().all(|value| value.is_finite()) {
            true => Ok(&self.vector),
            false => Err(StepError::NonFinite),
        }
    }

    /// Adds the step, or a fraction of it that reduces the residual of ∂E/∂z (damped Newton step): functions like −m√(1
    /// − v²) are undefined where a full step may lead.
    fn walk<M: Model>(&mut self, model: &M, (t, q): (f64, &[f64]), wanted: &[f64], z: &mut [f64]) {
        let n = z.len();
        let distance = |node: &Self| {
            let off = wanted.iter().zip(&node.slope).map(|(w, slope)| w - slope);
            off.fold(0.0, |sum, off| sum + off * off)
        };
        let before = distance(self);
        let mut fraction = 1.0;
        for _ in 0..MAX_HALVINGS {
            for (z, step) in z.iter_mut().zip(&self.vector[..n]) {
                *z += fraction * step;
            }
            if M::FACTS.quadratic_in_z || !self.rate.is_empty() {
                return;
            }
            self.slope(model, t, q, z);
            let after = distance(self);
            // Near the solution, rounding errors decide.
            if after <= before || largest(&self.vector[..n]) <= 1e-8 * largest(z) {
                return;
            }
            for (z, step) in z.iter_mut().zip(&self.vector[..n]) {
                *z -= fraction * step;
            }
            fraction *= 0.5;
        }
    }

    /// Whether the matrix that was factored last is far enough from singular for a solution to have digits: it has to
    /// reproduce a vector that was multiplied by it.
    pub(super) fn is_regular(&self) -> bool {
        let entries = || self.pattern.places().iter().zip(&self.derivatives);
        // A test vector scaled to the units of each coordinate, and irregular, so that no null vector is missed.
        let mut vector = vec![1.0; self.slope.len()];
        for ((_, row, column), value) in entries() {
            if row == column && value.abs() > 0.0 {
                vector[*row] = 1.0 / value.abs().sqrt();
            }
        }
        for (a, entry) in vector.iter_mut().enumerate() {
            *entry *= 1.0 + 0.5 * (1.7 * (a * a) as f64).sin();
        }
        let mut product = vec![0.0; self.vector.len()];
        for ((_, row, column), value) in entries() {
            product[*row] += value * vector[*column];
        }
        self.matrix.solve(&mut product);
        let mut pairs = vector.iter().zip(&product);
        pairs.all(|(wanted, found)| (wanted - found).abs() < REGULAR * wanted)
    }

    /// η of the last solution.
    pub(super) fn multipliers(&self) -> &[f64] {
        &self.vector[self.slope.len()..]
    }

    /// The largest entry of ∂²E/∂z∂z at the last iterate.
    pub(super) fn largest_mass(&self) -> f64 {
        largest(&self.derivatives)
    }

    fn slope<M: Model>(&mut self, model: &M, t: f64, q: &[f64], z: &[f64]) {
        let [by_q, force] = &mut self.unused;
        let first = Gradient {
            z: &mut self.slope,
            q: by_q,
            force,
        };
        model.first(t, q, z, first);
    }
}
