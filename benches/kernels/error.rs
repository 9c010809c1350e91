//! The errors.

use std::fmt;

/// Why the table cannot be printed.
#[derive(Debug)]
pub enum Error {
    /// The results of a generated and a hand-written kernel differ.
    Disagreement(Disagreement),
    /// The command line is invalid.
    Usage(String),
    /// The program could not be run again to count instructions.
    Count(std::io::Error),
    /// The output of the counting program has no total.
    NoTotal(String),
}

/// An entry that differs.
#[derive(Debug)]
pub struct Disagreement {
    /// The model.
    pub case: &'static str,
    /// The array of the result.
    pub array: &'static str,
    /// The index in it, row by row.
    pub index: usize,
    /// The generated value.
    pub generated: f64,
    /// The hand-written value.
    pub hand: f64,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Disagreement(Disagreement {
                case,
                array,
                index,
                generated,
                hand,
            }) => write!(
                f,
                "{case}: entry {index} of {array} is {generated:e} as generated, {hand:e} by hand"
            ),
            Self::Usage(argument) => write!(
                f,
                "cannot understand `{argument}`; either no arguments, or names of models and --instructions, or --count <model> <first|second> <generated|hand|nothing> <repetitions>"
            ),
            Self::Count(error) => write!(f, "cannot run valgrind: {error}"),
            Self::NoTotal(text) => write!(f, "valgrind gave no total:\n{text}"),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Count(error) => Some(error),
            _ => None,
        }
    }
}
