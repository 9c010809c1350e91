//! Linear systems of elements in a chain, as Newton's method for boundary-value problems, periodic motions and their
//! continuation produces them.
//!
//! Each element of a mesh couples its two nodes, conditions at the two ends close the chain, and a few global unknowns
//! (a period, a parameter) enter everywhere. `chain` solves the whole system at a cost proportional to the number of
//! elements, without the growth of rounding errors that shooting from one end to the other has.

mod chain;
mod constraints;
mod control;
mod convergence;
mod derivative;
mod error;
mod kinks;
mod mesh;
mod newton;
mod resolved;
mod solution;
mod warning;

pub use error::AssemblyError;
pub use mesh::MeshError;
pub use warning::MeshWarning;

pub(crate) use chain::{Chain, ClosureMut, DenseMut};
pub(crate) use control::{Control, check_tolerance};
pub(crate) use convergence::size;
#[cfg(feature = "sparse")]
pub(crate) use convergence::{Convergence, Size, sizes};
pub(crate) use derivative::derivatives;
pub(crate) use kinks::crossed_kinks;
pub(crate) use mesh::Mesh;
pub(crate) use newton::{Assembly, By, Iterate, Problem};
pub(crate) use resolved::HalvedCorrection;
pub(crate) use solution::Solution;

/// A curve t ↦ (q, dq/dt).
pub(crate) type Curve<'m, const N: usize> = Box<dyn Fn(f64) -> ([f64; N], [f64; N]) + 'm>;
