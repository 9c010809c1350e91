//! Two-point boundary-value problems: find the motion with given values at both ends of a span.

mod problem;
mod sensitive;

pub use problem::{BoundaryError, BoundaryMotion, BoundaryValue, Component};
pub use sensitive::SensitiveBoundaryMotion;

pub(crate) use problem::{Condition, check_conditions, check_span, straight};
