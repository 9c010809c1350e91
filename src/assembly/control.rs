//! How an assembled problem is solved.

/// How an assembled problem is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Control {
    /// The relative size of the last correction.
    pub(crate) tolerance: f64,
    /// The most iterations.
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
