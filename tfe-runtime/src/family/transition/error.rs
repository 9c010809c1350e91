//! Why a step of a model of run-time length has no derivative.

use crate::consistency::ModelError;
use crate::error::StepError;
use core::fmt;

/// Why the derivative of a step of a model of run-time length could not be computed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum OperatorError {
    /// The model is inconsistent, or the request is not supported.
    Family(ModelError),
    /// The step itself failed, or its tangent is singular.
    Step(StepError),
    /// The step is so long that it was made in pieces.
    Cut,
    /// A vector is not as long as the phase space.
    Shape {
        /// The required length.
        needed: usize,
        /// The length provided.
        given: usize,
    },
}

impl From<ModelError> for OperatorError {
    fn from(error: ModelError) -> Self {
        Self::Family(error)
    }
}

impl From<StepError> for OperatorError {
    fn from(error: StepError) -> Self {
        Self::Step(error)
    }
}

impl fmt::Display for OperatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Family(error) => error.fmt(f),
            Self::Step(error) => error.fmt(f),
            Self::Cut => f.write_str("the step had to be divided: take a shorter step"),
            Self::Shape { needed, given } => {
                write!(f, "the vector has {given} numbers, but needs {needed}")
            }
        }
    }
}

impl core::error::Error for OperatorError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Family(error) => error.source(),
            Self::Step(error) => error.source(),
            _ => None,
        }
    }
}
