//! Models of run-time length: `coordinates(q[n])` with n a field of the struct.
//!
//! [`Simulation::new`](crate::Simulation::new) takes them like models of fixed size. The types of runs and motions are
//! the same, with the last type parameter [`RunTimeLength`]; this module has aliases for them.
//!
//! Connections between sites may be given by a list of indices, and an output may be one number for each site:
//!
//! ```
//! use tfe::prelude::*;
//!
//! #[dynamics(
//!     coordinates(q[n]),
//!     lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(b in 0..bonds, k/2*(q[left[b]] - q[right[b]])^2),
//!     output(stretch[b in 0..bonds]) = q[left[b]] - q[right[b]],
//! )]
//! struct Network { n: usize, bonds: usize, k: f64, left: Vec<usize>, right: Vec<usize> }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A ring of three, and a fourth at one of them.
//! let (left, right) = (vec![0, 1, 2, 2], vec![1, 2, 0, 3]);
//! let network = Network { n: 4, bonds: 4, k: 1.0, left, right };
//! let motion = Simulation::new(&network)
//!     .step(0.1)
//!     .run(network.state([0.1, 0.0, 0.0, 0.0], [0.0; 4]), 0.0..10.0)?;
//! let last = motion.last();
//! let column = motion.outputs().column("stretch[3]").unwrap_or_default();
//! assert_eq!(column.last(), Some(&(last.q[2] - last.q[3])));
//!
//! let wrong = Network { left: vec![0, 1, 2, 7], ..network };
//! let error = Simulation::new(&wrong).run(wrong.state([0.0; 4], [0.0; 4]), 0.0..1.0);
//! let message = error.expect_err("there is no site 7").to_string();
//! assert!(message.contains("`left[3]` is 7"), "{message}");
//! # Ok(())
//! # }
//! ```

pub use crate::evaluate::Evaluate;
pub use crate::length::{Declared, FixedLength, RunTimeLength};
pub use tfe_runtime::family::{
    Block, Controlled, Entries, FamilyState, Gradient, Model, ModelError, Pattern, STRIDE, Stepper,
    Suspended, Sweep, constraint_residual, energy, momenta, state, velocity,
};

/// [`Simulation`](crate::Simulation) of a model of run-time length.
pub type Simulation<'m, M> = crate::Simulation<'m, M, 0, RunTimeLength>;
/// [`Motion`](crate::Motion) of a model of run-time length.
pub type Motion = crate::Motion<0, RunTimeLength>;
/// [`Node`](crate::Node) of a model of run-time length.
pub type Node = crate::Node<0, RunTimeLength>;
/// [`RunError`](crate::RunError) of a model of run-time length.
pub type RunError = crate::RunError<0, RunTimeLength>;
/// [`Sensitive`](crate::Sensitive) of a model of run-time length.
pub type Sensitive = crate::Sensitive<0, RunTimeLength>;
/// [`Loss`](crate::sensitivity::Loss) of a model of run-time length.
pub type Loss<'l> = crate::sensitivity::Loss<'l, 0, RunTimeLength>;
/// [`LossGradient`](crate::sensitivity::LossGradient) of a model of run-time length.
pub type LossGradient = crate::sensitivity::LossGradient<0, RunTimeLength>;
/// [`Steps`](crate::Steps) of a model of run-time length.
pub type Steps<'m, M> = crate::Steps<'m, M, 0, RunTimeLength>;
/// [`Driven`](crate::Driven), a model of run-time length with its inputs.
pub type Driven<'m, M> = crate::Driven<'m, M, RunTimeLength>;
/// [`Held`](crate::Held), a control loop of a model of run-time length.
pub type Held<'m, M> = crate::Held<'m, M, 0, RunTimeLength>;
/// [`Checkpoint`](crate::Checkpoint) of a model of run-time length.
pub type Checkpoint = crate::Checkpoint<0, RunTimeLength>;
