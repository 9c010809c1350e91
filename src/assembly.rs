//! Linear equations of elements in a chain: what Newton's method meets in boundary-value problems, periodic motions and
//! their continuation.
//!
//! The elements of a mesh are linked node to node, conditions at the two ends close the chain, and a few unknowns
//! (a period, a parameter) enter everywhere. `chain` solves the whole, at a cost proportional to the number of
//! elements and without the growth of round-off that stepping from one end to the other has.

mod chain;
mod constraints;
mod control;
mod convergence;
mod derivative;
mod error;
mod mesh;
mod newton;
mod resolved;
mod solution;

pub use error::AssemblyError;
pub use mesh::MeshError;

pub(crate) use chain::{Chain, ClosureMut, DenseMut};
pub(crate) use control::Control;
pub(crate) use convergence::size;
#[cfg(feature = "sparse")]
pub(crate) use convergence::{Convergence, Size, sizes};
pub(crate) use derivative::derivatives;
pub(crate) use mesh::Mesh;
pub(crate) use newton::{Assembly, By, Iterate, Problem};
pub(crate) use solution::Solution;

/// A curve t ↦ (q, dq/dt).
pub(crate) type Curve<'m, const N: usize> = Box<dyn Fn(f64) -> ([f64; N], [f64; N]) + 'm>;
