//! The errors of parameter identification.

use crate::error::RunErrorKind;
use crate::numbers::Short;
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
        /// The names that exist.
        known: Vec<String>,
    },
    /// The model cannot be copied with other parameters: it has none, or it has a field of a type that cannot be
    /// copied.
    NotCopied,
    /// The model has neither an output nor a coordinate of this name.
    NoOutput {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// Some measured values cannot be used.
    Measured {
        /// The output.
        name: String,
        /// The reason, with the first number that cannot be used.
        why: String,
    },
    /// A range does not contain the value at which the fit of its parameter starts, or belongs to a parameter that is
    /// not fitted.
    Bounds {
        /// The parameter.
        name: String,
        /// The lower end.
        low: f64,
        /// The upper end.
        high: f64,
        /// The value of the parameter at which the fit starts; NaN if the parameter is not fitted.
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
        /// The number of measured values.
        values: usize,
        /// The number of unknowns: the fitted parameters and, if the start is fitted, its 2N components.
        unknowns: usize,
    },
    /// The run with the first parameters failed. (If a later run fails, the step of the fit is shortened.)
    Run(RunErrorKind),
    /// With the first parameters, an output or its derivative is not finite.
    NotFinite,
    /// The iteration did not converge.
    NotConverged {
        /// The values of the unknowns with the smallest error found, first the parameters, then the start.
        best: Vec<f64>,
        /// The root mean square of (y − m)/σ with these values.
        deviation: f64,
        /// The number of runs made.
        runs: usize,
        /// Why the iteration ended.
        why: String,
    },
    /// The measured values do not determine all unknowns: some change of the unknowns changes no output.
    Undetermined {
        /// The unknown with the largest part in that change.
        name: String,
    },
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingUnknown => {
                f.write_str("nothing is unknown: name `.parameters([…])`, or leave out `.start(…)`")
            }
            Self::NothingMeasured => f.write_str("there are no measured values: give some with `.output(name, &times, &values)`"),
            Self::NoParameter { name, known } => write!(
                f,
                "`{name}` is not a parameter of the model, or was named twice; parameters are `{}`",
                known.join("`, `")
            ),
            Self::NotCopied => f.write_str(
                "the model cannot be copied with other parameters: it has no parameter, or a field that is neither a number nor an array of numbers",
            ),
            Self::NoOutput { name, known } => write!(
                f,
                "the model has no output or coordinate `{name}`, only `{}`",
                known.join("`, `")
            ),
            Self::Measured { name, why } => write!(f, "the values of `{name}` cannot be used: {why}"),
            Self::Bounds {
                name,
                low,
                high,
                value,
            } => {
                if value.is_nan() {
                    write!(f, "`{name}` has bounds but is not fitted: name it in `.parameters([…])`")
                } else {
                    write!(
                        f,
                        "`{name}` begins with {value}, which is not between {low} and {high}: change its value in the model, or the bounds",
                        value = Short(*value),
                        low = Short(*low),
                        high = Short(*high)
                    )
                }
            }
            Self::Early { time, start } => {
                let (time, at) = (Short(*time), Short(*start));
                if start.is_finite() {
                    write!(f, "a value was measured at t = {time}, before the start at {at}: give a start at or before the first time")
                } else {
                    write!(f, "the start is at t = {at}, but it must be finite: give a start at or before the first time, {time}")
                }
            }
            Self::StartOfConstraints => f.write_str(
                "the start of a model with constraints must be known: give `.start(state, t0)`",
            ),
            Self::TooFew { values, unknowns } => {
                write!(f, "{values} measured values cannot determine {unknowns} unknowns: measure more, or fit fewer parameters")
            }
            Self::Run(kind) => write!(f, "the run with the first parameters failed: {kind}"),
            Self::NotFinite => f.write_str(
                "an output or its derivative is not finite in the run with the first parameters: begin with other values",
            ),
            Self::NotConverged {
                deviation,
                runs,
                why,
                ..
            } => write!(
                f,
                "after {runs} runs the parameters were not found: {why}; the least deviation was {deviation:.3e}; begin nearer to the solution, or with fewer parameters"
            ),
            Self::Undetermined { name } => write!(
                f,
                "the measured values do not determine all unknowns: `{name}` can be changed, alone or with others, without changing any of them; measure another output, or leave it out of the fit"
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
