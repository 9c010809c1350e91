//! The tolerance and the iteration limit of assembled problems.

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
