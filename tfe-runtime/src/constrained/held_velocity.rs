//! The derivative of the velocity by the momentum where the mass matrix is singular and the constraints determine the
//! velocity (T-161).

use super::derivative::DualRows;
use super::node::{border, factor_bordered, is_regular};
use super::states::chosen;
use crate::condense::add_multiple;
use crate::constrained::rows::rows_len;
use crate::dual::Dual;
use crate::error::StepError;
use crate::lu;
use crate::model::{First, Form, Model};
use alloc::vec;
use alloc::vec::Vec;

/// The linear equations for changes of the velocity at a state, with their LU factors:
///
/// ```text
/// [ L_vv  Aᵀ ] [ δv ]   [ δp − ∂L_v − ∂(Aᵀ)η ]
/// [ A     0  ] [ δη ] = [ − ∂(A v + a)        ] ,     L_v(q, v, t) + Aᵀη = p                           (T-161)
/// ```
///
/// where ∂ denotes the change by time, coordinates and parameters at a fixed velocity. A mass matrix counts as singular
/// if a pivot is below 1e-10 of its column, and of the terms subtracted from it, as in
/// [`velocity_of`](super::velocity_of); redundant rows are omitted. Derivatives of velocities and outputs use it
/// (`Simulation::run_sensitive` of the crate `tfe`).
#[derive(Clone, Debug)]
pub struct HeldVelocity<const N: usize> {
    matrix: Vec<f64>,
    pivots: Vec<usize>,
    active: Vec<usize>,
    eta: Vec<f64>,
}

impl<const N: usize> HeldVelocity<N> {
    /// At coordinates q with momenta p and the velocities v of a Lagrangian; `None` where L_vv alone determines the
    /// velocity of a momentum, and without constraints.
    ///
    /// # Errors
    /// [`SingularMass`](crate::error::ConstraintError::SingularMass) where the kinetic energy is singular for motions that the constraints allow.
    pub fn of<M: Model<N>>(
        model: &M,
        t: f64,
        (q, p): (&[f64; N], &[f64; N]),
        v: &[f64; N],
    ) -> Result<Option<Self>, StepError> {
        if const { M::CONSTRAINTS.is_empty() || matches!(M::FORM, Form::Hamiltonian) } {
            return Ok(None);
        }
        let (mut first, mut zz) = (First::ZERO, [[0.0; N]; N]);
        model.first_and_mass(t, q, v, &mut first, &mut zz);
        if is_regular(zz) {
            return Ok(None);
        }
        let count = M::CONSTRAINTS.len();
        let size = N + count;
        let mut numbers = vec![0.0; rows_len(N, count)];
        let (rows, active) = chosen(model, (t, q), &mut numbers);
        let mut matrix = vec![0.0; size * size];
        border(&mut matrix, &zz, &rows, &active);
        let mut pivots = vec![0; size];
        factor_bordered::<N>(size, &mut matrix, &mut pivots)?;
        let mut held = Self {
            matrix,
            pivots,
            active,
            eta: Vec::new(),
        };
        let mut off = vec![0.0; size];
        for (off, (p, slope)) in off.iter_mut().zip(p.iter().zip(&first.z)) {
            *off = p - slope;
        }
        held.solve(&mut off);
        held.eta = off.split_off(N);
        Ok(Some(held))
    }

    fn solve(&self, vector: &mut [f64]) {
        lu::solve(vector.len(), &self.matrix, &self.pivots, vector);
    }

    /// δv, where time and coordinates carry slopes, and δp − ∂L_v is given.
    #[must_use]
    pub fn slope<M: Model<N>>(
        &self,
        model: &M,
        (t, q): (Dual, &[Dual; N]),
        v: &[f64; N],
        given: &[f64; N],
    ) -> [f64; N] {
        let mut rows = DualRows::<N>::new(self.active.len());
        rows.evaluate(model, t, q, v);
        let mut sides = given.to_vec();
        for (c, mark) in self.active.iter().enumerate() {
            if *mark == 0 {
                sides.push(0.0);
                continue;
            }
            sides.push(-rows.psi_slope(c, v));
            add_multiple(&mut sides[..N], -self.eta[c], &rows.row_slope(c));
        }
        self.solve(&mut sides);
        core::array::from_fn(|a| sides[a])
    }

    /// Converts weights of the velocity to those of the momentum, and returns the weights of A, row by row, and of a.
    pub(crate) fn pull(&self, v: &[f64; N], weights: &mut [f64; N]) -> (Vec<[f64; N]>, Vec<f64>) {
        let mut w = weights.to_vec();
        w.resize(N + self.active.len(), 0.0);
        // The matrix is symmetric.
        self.solve(&mut w);
        weights.copy_from_slice(&w[..N]);
        let drift: Vec<f64> = w[N..].iter().map(|taken| -taken).collect();
        let row = |c: usize| match self.active[c] {
            0 => [0.0; N],
            _ => core::array::from_fn(|a| drift[c] * v[a] - weights[a] * self.eta[c]),
        };
        let rows = (0..self.active.len()).map(row).collect();
        (rows, drift)
    }
}
