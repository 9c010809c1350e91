//! Constraints: positions φ(q, t) = 0 and velocities A(q, t) v + a(q, t) = 0, enforced by integrated multipliers (T-70
//! … T-79).
//!
//! Elements satisfy them exactly at their nodes. This module treats a single instant: the velocity that belongs to a
//! momentum under constraints, the residuals of the constraints, and which rows are linearly independent.

pub(crate) mod at_rest;
mod balance;
pub(crate) mod choose;
mod combine;
pub(crate) mod constrains;
mod derivative;
pub(crate) mod element;
#[cfg(feature = "alloc")]
mod held_velocity;
#[cfg(feature = "alloc")]
mod instant;
pub(crate) mod layout;
pub(crate) mod node;
pub(crate) mod own;
#[cfg(feature = "alloc")]
pub(crate) mod reach;
pub(crate) mod residual;
pub(crate) mod rows;
mod scaled;
#[cfg(feature = "std")]
mod start;
#[cfg(feature = "alloc")]
mod states;
mod tangent;
#[cfg(feature = "alloc")]
pub(crate) mod trail;
#[cfg(feature = "alloc")]
mod velocity_slope;

pub use crate::control::START_TOLERANCE;
#[cfg(feature = "std")]
pub use at_rest::start_residuals;
#[cfg(feature = "alloc")]
pub use at_rest::{reaction_rounding, work_of_roundings};
#[cfg(feature = "alloc")]
pub use held_velocity::HeldVelocity;
#[cfg(feature = "alloc")]
pub use instant::{Gradients, gradients, reactions};
#[cfg(feature = "std")]
pub use start::{Scales, own_residuals};
#[cfg(feature = "alloc")]
pub use states::{Residual, independent, residuals, units, velocity, velocity_for, velocity_of};
#[cfg(feature = "alloc")]
pub(crate) use trail::Foreseen;
#[cfg(feature = "alloc")]
pub use trail::Trail;
#[cfg(feature = "alloc")]
pub use velocity_slope::VelocitySlope;

pub(crate) use derivative::linearise;
#[cfg(feature = "alloc")]
pub(crate) use layout::check_element;
