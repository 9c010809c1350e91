//! Periodic orbits, their multipliers, and boundary-value problems against reference values and closed forms.

mod boundary;
mod branch_ends;
mod branches;
#[path = "../common/mod.rs"]
mod common;
mod constrained;
mod continuation;
mod convergence;
#[path = "../common/differences.rs"]
mod differences;
mod errors;
mod hybrid;
mod models;
mod orbits;
mod sensitive;
mod sizes;
