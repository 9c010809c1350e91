//! The errors of continuation.

use super::branch::Branch;
use crate::numbers::Short;
use crate::periodic::OrbitError;
use std::error::Error;
use std::fmt;
use tfe_runtime::Model;

/// Why a continuation failed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ContinuationErrorKind {
    /// No parameter was chosen: call `parameter`.
    NoParameter,
    /// The model has no derivative with respect to the parameter: it is not named in `sensitivity(…)`.
    NoSensitivity {
        /// The parameters with respect to which it has derivatives.
        known: &'static [&'static str],
    },
    /// No range of the parameter was given: call `range`.
    NoRange,
    /// The range is not finite, or the value that the model has does not lie in it, before its end.
    Range {
        /// The start of the range.
        start: f64,
        /// The end of the range.
        end: f64,
        /// The value of the parameter in the model as given.
        value: f64,
    },
    /// The step sizes are not positive and finite, or the first is not between the smallest and the largest.
    Steps {
        /// The first step.
        step: f64,
        /// The smallest step.
        smallest: f64,
        /// The largest step.
        largest: f64,
    },
    /// The first orbit was not found.
    Start(OrbitError),
    /// The corrector failed even with the smallest step.
    Step {
        /// The parameter of the last orbit.
        parameter: f64,
        /// The step that failed.
        step: f64,
        /// The error of the corrector; `None` if it found an orbit, but the branch turned too much.
        source: Option<OrbitError>,
    },
}

impl From<OrbitError> for ContinuationErrorKind {
    fn from(error: OrbitError) -> Self {
        Self::Start(error)
    }
}

impl fmt::Display for ContinuationErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoParameter => {
                f.write_str("no parameter is set: give `.parameter(|model| &mut model.omega)`")
            }
            Self::NoSensitivity { known } => {
                f.write_str(
                    "the model has no derivative with respect to this parameter: add `sensitivity(name)` to its `#[dynamics(...)]`",
                )?;
                match known {
                    [] => Ok(()),
                    known => write!(
                        f,
                        "; it has derivatives with respect to {}",
                        known.join(", ")
                    ),
                }
            }
            Self::NoRange => {
                f.write_str("no range of the parameter is set: give `.range(0.3..2.5)`")
            }
            Self::Range { start, end, value } => write!(
                f,
                "the range {start}..{end} must be finite and contain the value {value} of the model, before its end",
                start = Short(*start),
                end = Short(*end),
                value = Short(*value)
            ),
            Self::Steps {
                step,
                smallest,
                largest,
            } => write!(
                f,
                "the steps (first {step}, smallest {smallest}, largest {largest}) must be positive and finite, the first between the smallest and the largest",
                step = Short(*step),
                smallest = Short(*smallest),
                largest = Short(*largest)
            ),
            Self::Start(error) => write!(f, "no orbit at the start of the branch: {error}"),
            Self::Step {
                parameter,
                step,
                source,
            } => {
                write!(
                    f,
                    "the branch cannot be followed beyond the parameter {parameter} with a step of {step:.1e}: ",
                    parameter = Short(*parameter)
                )?;
                match source {
                    Some(error) => error.fmt(f),
                    None => f.write_str("the branch turns too sharply; allow shorter steps with `.smallest_step(…)`"),
                }
            }
        }
    }
}

impl Error for ContinuationErrorKind {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Start(error) => Some(error),
            Self::Step { source, .. } => source.as_ref().map(|error| error as _),
            _ => None,
        }
    }
}

/// A continuation that failed: why, and the branch up to there.
#[derive(Clone)]
pub struct ContinuationError<M, const N: usize> {
    kind: Box<ContinuationErrorKind>,
    partial: Box<Branch<M, N>>,
}

impl<M: Model<N>, const N: usize> ContinuationError<M, N> {
    pub(super) fn new(kind: ContinuationErrorKind, partial: Branch<M, N>) -> Self {
        Self {
            kind: Box::new(kind),
            partial: Box::new(partial),
        }
    }

    /// Why the continuation failed.
    pub fn kind(&self) -> &ContinuationErrorKind {
        &self.kind
    }

    /// The branch up to the failure; without points if no first orbit was found.
    pub fn partial(&self) -> &Branch<M, N> {
        &self.partial
    }

    /// The branch up to the failure, by value.
    pub fn into_partial(self) -> Branch<M, N> {
        *self.partial
    }
}

impl<M, const N: usize> fmt::Debug for ContinuationError<M, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ContinuationError")
            .field("kind", &self.kind)
            .field("partial", &self.partial)
            .finish()
    }
}

impl<M, const N: usize> fmt::Display for ContinuationError<M, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind.fmt(f)?;
        if self.partial.points.is_empty() {
            return Ok(());
        }
        write!(f, "; the branch so far is in `partial()`")
    }
}

impl<M, const N: usize> Error for ContinuationError<M, N> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.kind.source()
    }
}
