//! What can go wrong with the functions that give the inputs of a model.

/// A function that gives an input has returned a value that is not finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputFailure {
    /// The input.
    pub input: &'static str,
    /// The time at which the function was called.
    pub time: f64,
    /// The value that it returned.
    pub value: f64,
}

/// A function that gives an input has panicked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputPanicked;
