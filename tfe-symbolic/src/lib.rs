//! Symbolic engine of `tfe`: a declaration as text in, differentiated straight-line programs out.
//!
//! ```text
//! text ──parse──▶ AST ──check──▶ model ──lower──▶ declared ──derivation──▶ roots ──schedule──▶ program
//! ```
//!
//! Each arrow is a function from one named type to the next; [`compile`] lists them as far as the declared model. The crate
//! knows neither Rust tokens nor floating-point linear algebra.

pub mod check;
pub mod compile;
pub mod derive;
pub mod diagnostic;
pub mod expr;
pub mod lower;
pub mod model;
mod optimise;
mod pipeline;
pub mod program;
mod schedule;
pub mod syntax;
mod variants;
