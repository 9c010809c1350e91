//! From a declared model to the entries of its kernels: derivatives, constraints, and the forms of an energy that are derived apart. May
//! import `expr`, `model`, `optimise` and `program`.

pub(crate) mod constraint;
pub mod derivation;
pub(crate) mod entry;
pub(crate) mod limits;
pub(crate) mod quadratic;
pub(crate) mod sensitivity;
pub mod structure;
mod sweep;
