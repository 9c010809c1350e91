//! The errors of a whole ensemble.

use crate::error::RunErrorKind;
use std::error::Error;
use std::fmt;

/// Why no run of an [`Ensemble`](crate::Ensemble) could begin.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum EnsembleError {
    /// The element does not exist, or the step size or the span is invalid.
    Run(RunErrorKind),
    /// The number of starts is neither one nor the number of models.
    Starts {
        /// The number of models.
        models: usize,
        /// The number of starts.
        starts: usize,
    },
}

impl From<RunErrorKind> for EnsembleError {
    fn from(kind: RunErrorKind) -> Self {
        Self::Run(kind)
    }
}

impl fmt::Display for EnsembleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Run(kind) => kind.fmt(f),
            Self::Starts { models, starts } => write!(
                f,
                "{starts} starts were given for {models} models: give one start for all models, or one for each"
            ),
        }
    }
}

impl Error for EnsembleError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            // The text is that of the source.
            Self::Run(kind) => kind.source(),
            Self::Starts { .. } => None,
        }
    }
}
