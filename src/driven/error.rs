//! The errors of inputs.

use crate::numbers::Short;
use std::error::Error;
use std::fmt;

/// Why an input of a model cannot be used.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum InputError {
    /// The model declares no input of this name.
    Unknown {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<&'static str>,
    },
    /// The function of an input returned a number that is not finite, so that an element could not be solved.
    Value {
        /// The input.
        name: String,
        /// The time that the function was asked for.
        time: f64,
        /// The value that it returned.
        value: f64,
    },
    /// The function of an input panicked. The message of the panic is on standard error, or where the program's panic
    /// hook puts it.
    Panicked {
        /// The start of the element (or of the run) in which it was called.
        time: f64,
    },
    /// The period, the input or a sampling time of a sampled feedback is invalid.
    Sampling {
        /// The input.
        name: String,
        /// A time at which it was to be sampled.
        time: f64,
        /// The reason, with the numbers that are not possible.
        why: String,
    },
    /// An input was set to a number that is not finite.
    NotFinite {
        /// The input.
        name: String,
        /// The value.
        value: f64,
    },
    /// The table of an input is invalid.
    Table {
        /// The input.
        name: String,
        /// The reason, with the numbers that are not possible.
        why: String,
    },
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { name, known } => write!(
                f,
                "the model has no input `{name}`, only `{}`",
                known.join("`, `")
            ),
            Self::Value { name, time, value } => {
                write!(
                    f,
                    "the function of input `{name}` gives {value} at t = {time}, but it must be finite",
                    value = Short(*value),
                    time = Short(*time)
                )
            }
            Self::Panicked { time } => write!(
                f,
                "a function of an input panicked in the element that begins at t = {time}",
                time = Short(*time)
            ),
            Self::Sampling { name, time, why } => {
                write!(
                    f,
                    "the sampled feedback of input `{name}` at t = {time}: {why}",
                    time = Short(*time)
                )
            }
            Self::NotFinite { name, value } => write!(
                f,
                "input `{name}` was set to {value}, but it must be finite",
                value = Short(*value)
            ),
            Self::Table { name, why } => write!(f, "the table of input `{name}` is invalid: {why}"),
        }
    }
}

impl Error for InputError {}
