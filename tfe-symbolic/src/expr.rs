//! Expressions: the arena with its constructors, their inputs, functions and constants, and operations on expressions such as derivatives
//! and substitutions. Everything else builds on this folder; it imports nothing from outside.

pub mod constant;
pub mod differentiate;
pub mod function;
pub mod graph;
pub(crate) mod hash;
pub mod input;
pub(crate) mod polynomial;
pub(crate) mod rewrite;
pub(crate) mod simplify;
mod sums;
