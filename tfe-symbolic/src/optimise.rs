//! Passes that make results cheaper, first on expressions, then on plans of operations with at most two operands. May
//! import `expr`, and `program` for the measure of cost.

pub(crate) mod angles;
pub(crate) mod binarize;
pub(crate) mod canonical_order;
mod cse;
pub(crate) mod estimate;
pub(crate) mod factor;
pub(crate) mod guard;
pub(crate) mod identities;
pub mod passes;
pub(crate) mod plan;
mod rebuild;
pub(crate) mod scaled_trig;
pub(crate) mod signs;
