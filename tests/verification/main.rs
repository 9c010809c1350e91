//! Comparison with the theory: orders on nonlinear models, invariants, equivalences.

#![allow(missing_docs)] // what models and helpers mean is said where they are

#[path = "../common/mod.rs"]
mod common;

mod declarations;
mod equivalences;
mod invariants;
mod models;
mod runs;
mod settings;
mod trajectories;
