//! Why parameters are not found.

use crate::error::RunErrorKind;
use std::error::Error;
use std::fmt;

/// Why a fit has no result.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FitError {
    /// No parameter is looked for, and the start is known.
    NothingUnknown,
    /// There are no measured values.
    NothingMeasured,
    /// The model has no parameter of a name, or it was named twice.
    NoParameter {
        /// The name asked for.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// The model cannot be made with other parameters, nor copied: it has no parameter, or a field of a type that cannot be copied.
    NotCopied,
    /// The model has neither an output nor a coordinate of a name.
    NoOutput {
        /// The name asked for.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// Values that cannot be used.
    Measured {
        /// The output.
        name: String,
        /// What is wrong with them.
        why: &'static str,
    },
    /// A range that does not hold the first value of its parameter, or belongs to none that is looked for.
    Bounds {
        /// The parameter.
        name: String,
        /// The lower end.
        low: f64,
        /// The upper end.
        high: f64,
        /// The first value; NaN where it is not looked for.
        value: f64,
    },
    /// Something was measured before the start.
    Early {
        /// The first time of a measurement.
        time: f64,
        /// The time of the start.
        start: f64,
    },
    /// The start of a model with constraints is not looked for.
    StartOfConstraints,
    /// Fewer values than unknowns.
    TooFew {
        /// Measured values.
        values: usize,
        /// Parameters and numbers of the start that are looked for.
        unknowns: usize,
    },
    /// The run with the first parameters fails. Later ones that fail are refused as too far.
    Run(RunErrorKind),
    /// An output, or its derivative, is not finite with the first parameters.
    NotFinite,
    /// The iteration has not ended.
    NotConverged {
        /// The unknowns where the error was least, in the order of parameters and start.
        best: Vec<f64>,
        /// The root of the mean square of (y − m)/σ there.
        deviation: f64,
        /// Runs.
        runs: usize,
        /// What the iteration says.
        why: String,
    },
    /// The values do not tell all unknowns: some change of them changes no output.
    Undetermined {
        /// The one that takes most part in that change.
        name: String,
    },
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingUnknown => {
                f.write_str("nothing is looked for: name parameters, or leave the start open")
            }
            Self::NothingMeasured => f.write_str("there are no measured values"),
            Self::NoParameter { name, known } => write!(
                f,
                "`{name}` is no parameter that can be looked for once; parameters are `{}`",
                known.join("`, `")
            ),
            Self::NotCopied => f.write_str(
                "the model cannot be made with other parameters, nor copied: it has no parameter, or a field that is neither a number nor an array of numbers",
            ),
            Self::NoOutput { name, known } => write!(
                f,
                "the model has no output or coordinate `{name}`, only `{}`",
                known.join("`, `")
            ),
            Self::Measured { name, why } => write!(f, "the values of `{name}`: {why}"),
            Self::Bounds {
                name,
                low,
                high,
                value,
            } => {
                if value.is_nan() {
                    write!(f, "`{name}` has bounds but is not looked for")
                } else {
                    write!(
                        f,
                        "`{name}` begins with {value}, which is not between {low} and {high}"
                    )
                }
            }
            Self::Early { time, start } => {
                write!(f, "a value was measured at t = {time}, before the start at {start}")
            }
            Self::StartOfConstraints => f.write_str(
                "the start of a model with constraints must be known: `start(state, t0)`",
            ),
            Self::TooFew { values, unknowns } => {
                write!(f, "{values} values do not tell {unknowns} unknowns")
            }
            Self::Run(kind) => write!(f, "the run with the first parameters: {kind}"),
            Self::NotFinite => f.write_str(
                "an output or its derivative is not finite in the run with the first parameters",
            ),
            Self::NotConverged {
                deviation,
                runs,
                why,
                ..
            } => write!(
                f,
                "after {runs} runs the parameters are not found: {why}; the least deviation was {deviation:.3e}"
            ),
            Self::Undetermined { name } => write!(
                f,
                "the measured values do not tell all unknowns: `{name}` can be changed, with others or alone, without a change of any of them"
            ),
        }
    }
}

impl Error for FitError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Run(kind) => Some(kind),
            _ => None,
        }
    }
}
