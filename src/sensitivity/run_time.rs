//! Velocities and outputs of models of run-time length, differentiated along changes of states and parameters.

use crate::length::RunTimeLength;
use crate::motion::Node;
use nalgebra::{DMatrix, DVector, Dyn, LU};
use tfe_runtime::Form;
use tfe_runtime::dual::Dual;
use tfe_runtime::family::{Block, Entries, Gradient, Model};

/// The second derivative by velocities.
struct Mass(DMatrix<f64>);

impl Entries<f64> for Mass {
    fn add(&mut self, _: Block, row: usize, column: usize, value: f64) {
        self.0[(row, column)] += value;
    }
}

/// What velocities and outputs of a model do where a node changes.
pub(crate) struct Along<'a, M> {
    model: &'a M,
    node: &'a Node<0, RunTimeLength>,
    /// Factors of L_vv of a Lagrangian.
    factors: Option<LU<f64, Dyn, Dyn>>,
}

impl<'a, M: Model> Along<'a, M> {
    pub(crate) fn new(model: &'a M, node: &'a Node<0, RunTimeLength>) -> Self {
        let n = model.len();
        let factors = (M::FORM == Form::Lagrangian).then(|| {
            let mut mass = Mass(DMatrix::zeros(n, n));
            model.mass(node.t, &node.q, &node.v, &mut mass);
            mass.0.lu()
        });
        Self {
            model,
            node,
            factors,
        }
    }

    /// The changes of velocities, NaN where the mass matrix is singular, and of outputs; for one of (p, q) and of a parameter.
    pub(crate) fn slopes(&self, change: &[f64], parameter: Option<usize>) -> (Vec<f64>, Vec<f64>) {
        let n = self.model.len();
        let (by_p, by_q) = change.split_at(n);
        let time = Dual::new(self.node.t, 0.0).by_parameter(parameter);
        let q = duals(&self.node.q, by_q);
        let p = duals(&self.node.p, by_p);
        let velocity: Vec<f64> = match &self.factors {
            None => self.by_z(time, &q, &p),
            Some(factors) => {
                // p = L_v(q, v): L_vv δv = δp − ∂L_v/∂(q, a).
                let still = duals(&self.node.v, &vec![0.0; n]);
                let by_others = self.by_z(time, &q, &still);
                let right = DVector::from_fn(n, |a, _| by_p[a] - by_others[a]);
                let found = factors.solve(&right);
                found.map_or_else(|| vec![f64::NAN; n], |found| found.as_slice().to_vec())
            }
        };
        let mut values = vec![Dual::ZERO; self.model.columns()];
        if !values.is_empty() {
            let z = match M::FORM {
                Form::Lagrangian => duals(&self.node.v, &velocity),
                Form::Hamiltonian => p,
            };
            self.model.observables(time, &q, &z, &mut values);
        }
        let outputs = values.iter().map(|value| value.slope).collect();
        (velocity, outputs)
    }

    /// The slopes of L_v, or H_p.
    fn by_z(&self, time: Dual, q: &[Dual], z: &[Dual]) -> Vec<f64> {
        let zeros = || vec![Dual::ZERO; q.len()];
        let (mut by_z, mut by_q, mut force) = (zeros(), zeros(), zeros());
        let first = Gradient {
            z: &mut by_z,
            q: &mut by_q,
            force: &mut force,
        };
        self.model.first(time, q, z, first);
        by_z.iter().map(|one| one.slope).collect()
    }
}

fn duals(values: &[f64], slopes: &[f64]) -> Vec<Dual> {
    let pairs = values.iter().zip(slopes);
    pairs
        .map(|(value, slope)| Dual::new(*value, *slope))
        .collect()
}
