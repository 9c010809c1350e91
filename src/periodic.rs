//! Periodic orbits: elements over one period, assembled and closed, and the Floquet multipliers of the solution.
//!
//! ```text
//! δy_{e+1} − A_e δy_e − C_e δT = r_e ,   e = 0 … E − 1 ;      y_E = y_0 ;      one condition of phase if T is unknown
//! ```
//!
//! (`docs/theory.md`, (T-81)–(T-83)). The system is solved by structured orthogonal elimination: its cost is linear in the number E of
//! elements, and growing and decaying directions do not disturb each other. The multipliers are the eigenvalues of A_E ⋯ A_1; they come from
//! a periodic Schur decomposition of the matrices of the elements ([`crate::periodic_schur`]), never from the product, so that a multiplier of
//! 10⁻¹² keeps its digits beside one of 10¹².

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
