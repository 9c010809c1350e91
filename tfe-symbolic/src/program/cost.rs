//! The measure of cost: the cost of each operation in additions.
//!
//! Rounded from timings of scalar code and of lanes, where a sine alone costs as much as a sine with its cosine.
//! Negations are free: compilers combine them with the next operation.

/// a + b, a − b
pub(crate) const ADDITION: usize = 1;
/// a b
pub(crate) const PRODUCT: usize = 1;
/// a / b
pub(crate) const QUOTIENT: usize = 6;
/// A choice between two values
pub(crate) const CHOICE: usize = 1;
/// sin and cos of one argument
pub(crate) const SINE_WITH_COSINE: usize = 25;
/// sin or cos alone
pub(crate) const LONE_SINE: usize = 20;
/// Any other function, and powers that are not spelled out as products
pub(crate) const FUNCTION: usize = 20;
