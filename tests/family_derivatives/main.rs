//! Derivatives of steps of models of run-time length: transition operators, their spectra, periodic orbits.
#![cfg(feature = "sparse")]

mod orbits;
mod transitions;
