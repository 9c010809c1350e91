//! Expressions: the arena with its constructors, their inputs, functions and constants, and operations on expressions such as derivatives
//! and substitutions. Everything else builds on this folder; it imports nothing from outside.

mod cancellation;
pub mod comparison;
pub mod constant;
pub mod differentiate;
mod factors;
pub mod function;
mod function_derivatives;
pub mod graph;
pub(crate) mod hash;
pub mod input;
pub mod ordered;
pub(crate) mod polynomial;
pub(crate) mod rewrite;
mod roots;
pub(crate) mod simplify;
pub mod sorting;
mod sums;
