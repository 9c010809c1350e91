//! Models of either kind of length, as seen by derivatives along runs.

use super::slopes::Change;
use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length};
use crate::motion::Node;
use tfe_runtime::constrained::VelocitySlope;
use tfe_runtime::dual::{Dual, duals};
use tfe_runtime::{First, Form, Model};
#[cfg(feature = "sparse")]
use {
    super::run_time, crate::length::RunTimeLength, tfe_runtime::family,
    tfe_runtime::family::Gradient,
};

/// The change of the velocity, δv, as a function of a change at a point.
pub(crate) type Velocity<'a, const N: usize, L> =
    Box<dyn Fn(&Change<N, L>) -> <L as Length<N>>::Vector + 'a>;

/// A model whose runs have derivatives: every [`Model`] and every [`family::Model`], and nothing else.
pub(crate) trait Varied<const N: usize, L: Length<N>> {
    /// The derivatives of the velocities at a node; NaN if the mass matrix is singular.
    fn velocity_along<'a>(&'a self, node: &'a Node<N, L>) -> Velocity<'a, N, L>;

    /// dp/dt at a node: L_q + Q of a Lagrangian, Q − H_q of a Hamiltonian, and the reactions Aᵀλ of constraints; NaN if
    /// there are none.
    fn push(&self, node: &Node<N, L>) -> L::Vector;
}

/// The sign with which the derivative of L, or of H, by the coordinates enters dp/dt.
fn sign(form: Form) -> f64 {
    match form {
        Form::Lagrangian => 1.0,
        Form::Hamiltonian => -1.0,
    }
}

impl<M: Model<N>, const N: usize> Varied<N, FixedLength> for M {
    fn velocity_along<'a>(&'a self, node: &'a Node<N>) -> Velocity<'a, N, FixedLength> {
        let Node { t, q, p, v } = node;
        let slope = VelocitySlope::new(self, *t, (q, p), v);
        Box::new(move |change| {
            let time = Dual::new(*t, change.t).by_parameter(change.parameter);
            slope.along(time, (&duals(q, &change.q), &duals(p, &change.p)))
        })
    }

    fn push(&self, node: &Node<N>) -> [f64; N] {
        let z = match M::FORM {
            Form::Lagrangian => &node.v,
            Form::Hamiltonian => &node.p,
        };
        let mut first = First::ZERO;
        self.first(node.t, &node.q, z, &mut first);
        let mut push = pushed(sign(M::FORM), &first);
        if const { !M::CONSTRAINTS.is_empty() } {
            let at = (&node.q, &node.p);
            let reactions = Evaluate::<N, FixedLength>::reactions(self, node.t, at, &node.v);
            let mut rows = vec![[0.0; N]; reactions.len()];
            let mut drift = vec![0.0; reactions.len()];
            self.constraint_rows(node.t, &node.q, &mut rows, &mut drift);
            add_reactions(&mut push, &rows, &reactions);
        }
        push
    }
}

/// dp/dt without reactions of constraints.
fn pushed<const N: usize>(sign: f64, first: &First<f64, N>) -> [f64; N] {
    std::array::from_fn(|a| sign * first.q[a] + first.force[a])
}

/// Adds Aᵀλ.
fn add_reactions<const N: usize>(push: &mut [f64; N], rows: &[[f64; N]], reactions: &[f64]) {
    for (row, reaction) in rows.iter().zip(reactions) {
        for (push, entry) in push.iter_mut().zip(row) {
            *push += entry * reaction;
        }
    }
}

#[cfg(feature = "sparse")]
impl<M: family::Model> Varied<0, RunTimeLength> for M {
    fn velocity_along<'a>(
        &'a self,
        node: &'a Node<0, RunTimeLength>,
    ) -> Velocity<'a, 0, RunTimeLength> {
        let along = run_time::Along::new(self, node);
        Box::new(move |change| along.velocity(change))
    }

    fn push(&self, node: &Node<0, RunTimeLength>) -> Vec<f64> {
        let z = match M::FORM {
            Form::Lagrangian => &node.v,
            Form::Hamiltonian => &node.p,
        };
        let zeros = || vec![0.0; node.q.len()];
        let (mut by_z, mut by_q, mut force) = (zeros(), zeros(), zeros());
        let first = Gradient {
            z: &mut by_z,
            q: &mut by_q,
            force: &mut force,
        };
        self.first(node.t, &node.q, z, first);
        let sign = sign(M::FORM);
        let both = by_q.iter().zip(&force);
        // Models without forces leave `force` at zero.
        let mut push: Vec<f64> = both.map(|(by_q, force)| sign * by_q + force).collect();
        if M::CONSTRAINED {
            let at = (&node.q, &node.p);
            let lambda = Evaluate::<0, RunTimeLength>::reactions(self, node.t, at, &node.v);
            let mut drift = vec![0.0; lambda.len()];
            let mut reactions = Reactions {
                lambda: &lambda,
                forces: &mut push,
            };
            self.constraint_rows(node.t, &node.q, &mut drift, &mut reactions);
        }
        push
    }
}

/// Adds the reactions Aᵀλ to forces.
#[cfg(feature = "sparse")]
struct Reactions<'a> {
    lambda: &'a [f64],
    forces: &'a mut [f64],
}

#[cfg(feature = "sparse")]
impl family::Entries<f64> for Reactions<'_> {
    fn add(&mut self, _: family::Block, row: usize, column: usize, value: f64) {
        self.forces[column] += value * self.lambda[row];
    }
}
