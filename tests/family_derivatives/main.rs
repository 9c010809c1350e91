//! Derivatives of steps of models of run-time length: transition operators, their spectra, periodic orbits.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/differences.rs"]
mod differences;
#[path = "../common/lengths.rs"]
mod lengths;

mod constrained;
mod constrained_events;
mod events;
mod gradients;
mod hybrid;
mod orbits;
mod transitions;
