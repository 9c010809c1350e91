//! Symbolic engine of `tfe`: a declaration as text in, differentiated straight-line programs out.
//!
//! ```text
//! text ──parse──▶ AST ──check──▶ model ──lower──▶ declared ──derivation──▶ roots ──schedule──▶ program
//! ```
//!
//! Each arrow is a function from one named type to the next; [`compile`] lists them as far as the declared model. The crate
//! knows neither Rust tokens nor floating-point linear algebra.
//!
//! Folders are layers: each imports those below it only, and no two files import each other in a circle. From below:
//!
//! ```text
//! expr ─ vocabulary ─ diagnostic ─ syntax ─ model ─ program ─ optimise ─ derive ─ schedule ─ check ─ variants ─ lower ─ pipeline ─ compile
//! ```

pub mod check;
pub mod compile;
pub mod derive;
pub mod diagnostic;
pub mod expr;
pub mod lower;
pub mod model;
mod optimise;
pub mod pipeline;
pub mod program;
mod schedule;
pub mod syntax;
mod variants;
pub mod vocabulary;
