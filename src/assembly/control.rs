//! The tolerance and the iteration limit of assembled problems.

use super::error::AssemblyError;
use crate::numbers::is_tolerance;

/// The stopping criteria of Newton's method for assembled problems.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Control {
    /// The relative size of the last correction at which the iteration ends.
    pub(crate) tolerance: f64,
    /// The largest number of iterations.
    pub(crate) max_iterations: u32,
}

impl Default for Control {
    fn default() -> Self {
        Self {
            tolerance: 1e-13,
            max_iterations: 50,
        }
    }
}

impl Control {
    /// Refuses a tolerance with which the iteration would accept anything, or nothing.
    pub(crate) fn check(&self) -> Result<(), AssemblyError> {
        check_tolerance(self.tolerance)
    }
}

/// The same for a tolerance alone.
pub(crate) fn check_tolerance(tolerance: f64) -> Result<(), AssemblyError> {
    if is_tolerance(tolerance) {
        return Ok(());
    }
    Err(AssemblyError::Tolerance { tolerance })
}
