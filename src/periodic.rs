//! Periodic orbits and their Floquet multipliers: find a motion that repeats after a period T.
//!
//! The elements over one period are assembled and solved together, closed by periodicity; Newton's method solves
//!
//! ```text
//! δy_{e+1} − A_e δy_e − C_e δT = r_e ,   e = 0 … E − 1 ;      y_E = y_0 ;      one phase condition if T is unknown
//! ```
//!
//! (`docs/theory.md`, (T-81)–(T-83)) with A_e the transition matrix of element e. The system is solved by structured
//! orthogonal elimination: the cost is linear in the number E of elements, and neither growing nor decaying directions
//! spoil the result. The Floquet multipliers are the eigenvalues of the monodromy matrix A_E ⋯ A_1. They come from a
//! periodic Schur decomposition of the matrices of the elements ([`crate::periodic_schur`]), never from the product,
//! so that a multiplier of 10⁻¹² keeps its digits beside one of 10¹².

mod closing;
mod error;
#[cfg(feature = "sparse")]
mod family;
mod hybrid;
mod hybrid_sensitive;
mod kind;
mod moving;
pub(crate) mod orbit;
mod phase;
pub(crate) mod problem;
pub(crate) mod repeats;
mod rest;
mod sensitive;
mod setup;

pub use error::OrbitError;
pub use hybrid::{HybridOrbit, HybridOrbits};
pub use kind::{Chained, Closed};
pub use orbit::{Exponent, Orbit, Verdict};
pub use phase::Phase;
pub use sensitive::{OrbitSlopes, SensitiveOrbit};
pub use setup::PeriodicOrbit;
pub(crate) use setup::along_motion;
