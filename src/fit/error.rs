//! Why parameters are not found.

use crate::error::RunErrorKind;
use std::error::Error;
use std::fmt;

/// Why a fit has no result.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FitError {
    /// Nothing is unknown: no parameter was named, and the start is given.
    NothingUnknown,
    /// There are no measured values.
    NothingMeasured,
    /// The model has no parameter of this name, or it was named twice.
    NoParameter {
        /// The name asked for.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// The model cannot be copied with other parameters: it has none, or it has a field of a type that cannot be
    /// copied.
    NotCopied,
    /// The model has neither an output nor a coordinate of this name.
    NoOutput {
        /// The name asked for.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// Measured values that cannot be used.
    Measured {
        /// The output.
        name: String,
        /// What is wrong with them.
        why: &'static str,
    },
    /// A range that does not contain the first value of its parameter, or that belongs to a parameter that is not
    /// fitted.
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
    /// A value was measured before the start.
    Early {
        /// The first time of a measurement.
        time: f64,
        /// The time of the start.
        start: f64,
    },
    /// The start of a model with constraints cannot be an unknown; give it with `start`.
    StartOfConstraints,
    /// There are fewer measured values than unknowns.
    TooFew {
        /// Measured values.
        values: usize,
        /// Parameters and numbers of the start that are looked for.
        unknowns: usize,
    },
    /// The run with the first parameters failed. (If a later run fails, the step of the fit is shortened.)
    Run(RunErrorKind),
    /// With the first parameters, an output or its derivative is not finite.
    NotFinite,
    /// The iteration did not converge.
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
    /// The measured values do not determine all unknowns: some change of the unknowns changes no output.
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
