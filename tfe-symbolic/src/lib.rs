//! Symbolic engine of `tfe`: a declaration as text in, differentiated straight-line programs out.
//!
//! ```text
//! text ──parse──▶ AST ──check──▶ model ──lower──▶ declared ──derivation──▶ roots ──schedule──▶ program
//! ```
//!
//! Each arrow is a function from one named type to the next; [`compile`] lists them. The crate knows
//! neither Rust tokens nor floating-point linear algebra.

mod alike;
mod angles;
mod arms;
mod arrange;
pub mod ast;
mod balance;
mod blocks;
pub mod check;
mod collect;
pub mod compile;
pub mod constant;
mod constraint;
pub mod context;
pub mod count;
pub mod declared;
pub mod derivation;
pub mod diagnostic;
pub mod differentiate;
mod distribute;
mod draft;
mod entry;
mod expand;
mod factor;
pub mod function;
pub mod graph;
mod identities;
pub mod input;
pub mod interpret;
mod listing;
pub mod lower;
pub mod notation;
mod order;
mod pairs;
pub mod parse;
mod plan;
mod print;
pub mod program;
mod quadratic;
mod rebuild;
mod reduce;
mod rewrite;
mod schedule;
mod sensitivity;
mod signs;
mod simplify;
mod squares;
pub mod structure;
mod table;
mod writes;
