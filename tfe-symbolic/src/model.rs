//! The model after checking and lowering, in expressions and in mathematical notation. May import `expr` and `syntax`.

pub mod declared;
pub mod notation;
