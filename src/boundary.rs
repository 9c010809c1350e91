//! Boundary-value problems: elements over a span, assembled, with conditions at both ends.

mod problem;
mod sensitive;

pub use problem::{BoundaryError, BoundaryMotion, BoundaryValue, Component};
pub use sensitive::SensitiveBoundaryMotion;

pub(crate) use problem::{Condition, check_conditions, check_span, straight};
