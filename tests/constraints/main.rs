//! Constrained models: against reference tables and closed forms, against minimal coordinates, over long runs, and where they start wrong.

#![allow(missing_docs)] // what models and helpers mean is said where they are

#[path = "../common/mod.rs"]
mod common;

mod bodies;
mod elements;
mod linkages;
mod long_runs;
mod mechanisms;
mod models;
mod nonholonomic;
mod orders;
mod overconstrained;
mod reactions;
mod redundant;
mod reference_values;
mod runs;
mod singular;
mod small_steps;
mod stability;
mod starts;
mod symplectic;
mod tolerances;
