//! Derivatives of velocities by states, times and parameters, for models of run-time length.

use crate::length::RunTimeLength;
use crate::motion::Node;
use crate::sensitivity::slopes::Change;
use nalgebra::{DMatrix, DVector, Dyn, LU};
use tfe_runtime::Form;
use tfe_runtime::dual::Dual;
use tfe_runtime::family::{Block, Entries, Gradient, Model};

/// Collects the entries of the mass matrix ∂²L/∂v², and of the rows of constraints that border it.
struct Mass {
    entries: Vec<(usize, usize, f64)>,
    n: usize,
}

impl Entries<f64> for Mass {
    fn add(&mut self, block: Block, row: usize, column: usize, value: f64) {
        if block == Block::Row {
            self.entries.push((self.n + row, column, value));
            self.entries.push((column, self.n + row, value));
        } else {
            self.entries.push((row, column, value));
        }
    }
}

/// A factorised matrix.
enum Factors {
    /// The diagonal of a matrix that has no other entries.
    Diagonal(Vec<f64>),
    Full(LU<f64, Dyn, Dyn>),
}

impl Factors {
    /// Those of a square matrix with `size` rows.
    fn of(entries: &[(usize, usize, f64)], size: usize) -> Self {
        if entries.iter().all(|(row, column, _)| row == column) {
            let mut diagonal = vec![0.0; size];
            for (row, _, value) in entries {
                diagonal[*row] += value;
            }
            return Self::Diagonal(diagonal);
        }
        let mut matrix = DMatrix::zeros(size, size);
        for (row, column, value) in entries {
            matrix[(*row, *column)] += value;
        }
        Self::Full(matrix.lu())
    }

    /// The solution; `None` if the matrix is singular.
    fn solve(&self, right: Vec<f64>) -> Option<Vec<f64>> {
        match self {
            Self::Full(factors) => {
                let found = factors.solve(&DVector::from_vec(right))?;
                Some(found.as_slice().to_vec())
            }
            Self::Diagonal(diagonal) => {
                let pairs = right.iter().zip(diagonal);
                let found = pairs.map(|(right, entry)| (*entry != 0.0).then(|| right / entry));
                found.collect()
            }
        }
    }

    /// Whether velocities are determined without constraints. Pivots are compared with their columns, whose units are
    /// those of coordinates, and with the terms subtracted in the elimination, since rows have these units, too.
    fn is_regular(&self) -> bool {
        const SINGULAR: f64 = 1e-10;
        let factors = match self {
            Self::Diagonal(diagonal) => return diagonal.iter().all(|entry| entry.abs() > 0.0),
            Self::Full(factors) => factors,
        };
        let (l, u) = (factors.l(), factors.u());
        (0..u.ncols()).all(|a| {
            let pivot = u[(a, a)].abs();
            let subtracted = || -> f64 { (0..a).map(|k| (l[(a, k)] * u[(k, a)]).abs()).sum() };
            pivot > SINGULAR * u.column(a).amax() || pivot > SINGULAR * subtracted()
        })
    }
}

/// Evaluates A v and Aᵀη with derivatives.
struct ConstraintProducts<'a> {
    v: &'a [f64],
    eta: &'a [f64],
    rates: Vec<Dual>,
    reactions: Vec<Dual>,
}

impl Entries<Dual> for ConstraintProducts<'_> {
    fn add(&mut self, _: Block, row: usize, column: usize, value: Dual) {
        self.rates[row] += value * Dual::new(self.v[column], 0.0);
        self.reactions[column] += value * Dual::new(self.eta[row], 0.0);
    }
}

/// The derivatives of the velocities of a model at a node.
pub(crate) struct Along<'a, M> {
    model: &'a M,
    node: &'a Node<0, RunTimeLength>,
    /// The factors of L_vv of a Lagrangian; if that is singular and there are constraints, those of the matrix of
    /// (T-74).
    factors: Option<Factors>,
    /// The multipliers η of this matrix, with p = L_v + Aᵀη; `None` for L_vv alone.
    eta: Option<Vec<f64>>,
}

impl<'a, M: Model> Along<'a, M> {
    pub(crate) fn new(model: &'a M, node: &'a Node<0, RunTimeLength>) -> Self {
        let mut along = Self {
            model,
            node,
            factors: None,
            eta: None,
        };
        if M::FORM == Form::Hamiltonian {
            return along;
        }
        let factors = along.factored(0);
        let is_regular = model.constraints() == 0 || factors.is_regular();
        along.factors = Some(factors);
        if !is_regular {
            let n = model.len();
            let factors = along.factored(model.constraints());
            let still = |values: &[f64]| duals(values, &vec![0.0; n]);
            let slope = along.first(Dual::new(node.t, 0.0), &still(&node.q), &still(&node.v));
            let pairs = slope.iter().zip(&node.p);
            let mut right: Vec<f64> = pairs.map(|(slope, p)| p - slope.value).collect();
            right.resize(n + model.constraints(), 0.0);
            let found = factors.solve(right);
            along.eta = found.map(|found| found[n..].to_vec());
            along.factors = Some(factors);
        }
        along
    }

    /// Factorises L_vv, bordered by a number of rows of constraints.
    fn factored(&self, rows: usize) -> Factors {
        let (model, node) = (self.model, self.node);
        let n = model.len();
        let entries = Vec::new();
        let mut mass = Mass { entries, n };
        model.mass(node.t, &node.q, &node.v, &mut mass);
        if rows > 0 {
            model.constraint_rows(node.t, &node.q, &mut vec![0.0; rows], &mut mass);
        }
        Factors::of(&mass.entries, n + rows)
    }

    /// δv; NaN if the mass matrix is singular.
    pub(crate) fn velocity(&self, change: &Change<0, RunTimeLength>) -> Vec<f64> {
        let n = self.model.len();
        let time = Dual::new(self.node.t, change.t).by_parameter(change.parameter);
        let q = duals(&self.node.q, &change.q);
        let Some(factors) = &self.factors else {
            return self.by_z(time, &q, &duals(&self.node.p, &change.p));
        };
        // p = L_v(q, v, t): L_vv δv = δp − ∂L_v/∂(t, q, a).
        let still = duals(&self.node.v, &vec![0.0; n]);
        let by_others = self.by_z(time, &q, &still);
        let by_p = change.p.iter().zip(&by_others);
        let mut right: Vec<f64> = by_p.map(|(p, l)| p - l).collect();
        if let Some(eta) = &self.eta {
            self.add_held(time, &q, eta, &mut right);
        }
        let found = factors.solve(right);
        found.map_or_else(|| vec![f64::NAN; n], |found| found[..n].to_vec())
    }

    /// Subtracts the derivatives of Aᵀη from the entries of `right`, and appends those of −(A v + a), at constant
    /// velocities and multipliers.
    fn add_held(&self, time: Dual, q: &[Dual], eta: &[f64], right: &mut Vec<f64>) {
        let mut drift = vec![Dual::ZERO; eta.len()];
        let mut held = ConstraintProducts {
            v: &self.node.v,
            eta,
            rates: drift.clone(),
            reactions: vec![Dual::ZERO; q.len()],
        };
        (self.model).constraint_rows(time, q, &mut drift, &mut held);
        for (right, reaction) in right.iter_mut().zip(&held.reactions) {
            *right -= reaction.slope;
        }
        let rates = held.rates.iter().zip(&drift);
        right.extend(rates.map(|(rate, drift)| -(*rate + *drift).slope));
    }

    /// The derivatives of L_v, or of H_p.
    fn by_z(&self, time: Dual, q: &[Dual], z: &[Dual]) -> Vec<f64> {
        let first = self.first(time, q, z);
        first.iter().map(|one| one.slope).collect()
    }

    /// L_v, or H_p.
    fn first(&self, time: Dual, q: &[Dual], z: &[Dual]) -> Vec<Dual> {
        let zeros = || vec![Dual::ZERO; q.len()];
        let (mut by_z, mut by_q, mut force) = (zeros(), zeros(), zeros());
        let first = Gradient {
            z: &mut by_z,
            q: &mut by_q,
            force: &mut force,
        };
        self.model.first(time, q, z, first);
        by_z
    }
}

fn duals(values: &[f64], slopes: &[f64]) -> Vec<Dual> {
    let pairs = values.iter().zip(slopes);
    pairs
        .map(|(value, slope)| Dual::new(*value, *slope))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masses_are_regular_in_any_units() {
        let regular = |entries: [f64; 4]| {
            let places = [(0, 0), (0, 1), (1, 0), (1, 1)];
            let entries = places.iter().zip(entries);
            let entries: Vec<_> = entries
                .map(|((row, column), x)| (*row, *column, x))
                .collect();
            Factors::of(&entries, 2).is_regular()
        };
        for length in [1.0, 1e-6, 1e-11, 1e-14, 1e-20, 1e11] {
            // A body of mass one with a pendulum of mass one half; and the pendulum alone, whose bob and angle move in
            // the same way.
            let (turned, square) = (0.5 * length, 0.5 * length * length);
            assert!(regular([1.5, turned, turned, square]), "{length}");
            assert!(regular([square, turned, turned, 1.5]), "{length}");
            assert!(!regular([0.5, turned, turned, square]), "{length}");
        }
    }

    /// A diagonal matrix needs no elimination, however many masses there are.
    #[test]
    fn diagonal_masses_are_divisors() {
        let diagonal: Vec<_> = (0..4).map(|a| (a, a, 1.0 + a as f64)).collect();
        let mut twice = diagonal.clone();
        twice.push((3, 3, 1.0));
        let factors = Factors::of(&twice, 4);
        assert!(matches!(factors, Factors::Diagonal(_)) && factors.is_regular());
        let found = factors.solve(vec![1.0, 1.0, 6.0, 10.0]);
        assert_eq!(found, Some(vec![1.0, 0.5, 2.0, 2.0]));
        let singular = Factors::of(&diagonal[..3], 4);
        assert!(singular.solve(vec![1.0; 4]).is_none() && !singular.is_regular());
    }
}
