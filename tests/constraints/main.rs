//! Constrained models: compared with reference tables, closed forms and minimal coordinates, in long runs, and from
//! invalid initial states.

#![allow(missing_docs)] // what models and helpers mean is said where they are

#[path = "../common/mod.rs"]
mod common;

mod at_rest;
mod bodies;
mod elements;
mod linkages;
mod long_runs;
mod mechanisms;
mod models;
mod moves;
mod nonholonomic;
mod orders;
mod overconstrained;
mod reactions;
mod redundant;
mod reference_values;
mod released;
mod runs;
mod singular;
mod small_steps;
mod spatial_four_bar;
mod stability;
mod starts;
mod symplectic;
mod through_zero;
mod tolerances;
