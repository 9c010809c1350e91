//! What may go wrong with functions that are given for inputs.

/// What was wrong with a function that was given for an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputFailure {
    /// The input.
    pub input: &'static str,
    /// The time that the function was asked for.
    pub time: f64,
    /// What it gave.
    pub value: f64,
}

/// A function that was given for an input has panicked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputPanicked;
