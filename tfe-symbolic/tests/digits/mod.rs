//! Random models judged by how many digits their kernels lose against the formulas as they are written.
//!
//! ```text
//! models, cases ──▶ text ──▶ the engine: declare, derive, interpret ──▶ found
//!        └───────▶ formulas ──▶ derivatives by the chain rule ──▶ plain (f64), exact (double-double)   ──▶ judge
//! ```

pub mod cases;
pub mod double_double;
pub mod entries;
pub mod formula;
pub mod judge;
pub mod kernels;
pub mod models;
pub mod random;
pub mod reference;
pub mod report;
pub mod scalar;
pub mod states;
pub mod writer;
