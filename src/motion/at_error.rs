//! The errors of evaluating a motion at a time.

use crate::numbers::Short;
use std::error::Error;
use std::fmt;
use tfe_runtime::ModelError;

/// Why a motion cannot be evaluated at a time, or an output of it be integrated.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum AtError {
    /// The time lies outside the span of the motion.
    Outside {
        /// The time asked for.
        time: f64,
        /// First time of the motion.
        start: f64,
        /// Last time of the motion.
        end: f64,
    },
    /// The element that contains the time was not recorded (`record_every` keeps only some).
    NotRecorded {
        /// The time asked for.
        time: f64,
    },
    /// The model declares no output of this name.
    NoOutput {
        /// The name asked for.
        output: String,
        /// The outputs that there are.
        known: Vec<String>,
    },
    /// The model given is not that of the run: an output has another value than the one recorded, as without the inputs
    /// of the run or with other parameters.
    OtherModel {
        /// The output.
        output: String,
        /// The time of the recorded node.
        time: f64,
        /// The value that the run recorded.
        recorded: f64,
        /// The value that the model given has there.
        computed: f64,
    },
    /// No velocity belongs to the momentum at this time, for example because the mass matrix is singular there.
    NoVelocity {
        /// The time.
        time: f64,
    },
    /// The model does not pass its [check](crate::Model::check).
    Model(ModelError),
}

impl fmt::Display for AtError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outside { time, start, end } => {
                write!(
                    f,
                    "t = {time} lies outside the motion, which spans {start} to {end}",
                    time = Short(*time),
                    start = Short(*start),
                    end = Short(*end)
                )
            }
            Self::NotRecorded { time } => write!(
                f,
                "the element around t = {time} was not recorded; run without `record_every` for dense output",
                time = Short(*time)
            ),
            Self::NoOutput { output, known } if known.is_empty() => {
                write!(
                    f,
                    "there is no output `{output}`: the model declares none; add `output({output}) = …` to its `#[dynamics(...)]`"
                )
            }
            Self::NoOutput { output, known } => write!(
                f,
                "there is no output `{output}`; the model has `{}`",
                known.join("`, `")
            ),
            Self::OtherModel {
                output,
                time,
                recorded,
                computed,
            } => write!(
                f,
                "the model is not that of the run: at t = {time} its output `{output}` is {computed}, recorded was {recorded}; \
                 it needs the parameters of the run, and after `.input(…)` or `.table(…)` the same inputs, as a `Driven` model",
                time = Short(*time),
                computed = Short(*computed),
                recorded = Short(*recorded)
            ),
            Self::NoVelocity { time } => {
                write!(
                    f,
                    "no velocity belongs to the momentum at t = {time}: is the mass matrix singular there?",
                    time = Short(*time)
                )
            }
            Self::Model(error) => error.fmt(f),
        }
    }
}

impl Error for AtError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Model(error) => Some(error),
            _ => None,
        }
    }
}
