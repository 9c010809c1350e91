//! Elements and steps: orders, equivalences, structure, failures.

mod common;

mod bundle;
mod condenser;
mod constrained;
mod legendre;
mod nodal_forms;
mod propagator;
mod steps;
mod tableaus;
mod tables;
