//! Derivatives of steps of models of run-time length: transition operators, their spectra, periodic orbits.
#![cfg(feature = "sparse")]

#[path = "../common/differences.rs"]
mod differences;
#[path = "../common/largest.rs"]
mod largest;

mod constrained;
mod constrained_events;
mod events;
mod gradients;
mod hybrid;
mod lengths;
mod orbits;
mod transitions;
