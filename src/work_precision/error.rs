//! The errors of work-precision diagrams, before the first run and when results are written.

#[cfg(feature = "charts")]
use crate::charts::ChartError;
use crate::error::RunErrorKind;
use crate::numbers::{Short, WrongTolerance};
use std::error::Error;
use std::fmt;
use std::io;
use std::path::PathBuf;
use tfe_runtime::ElementError;

/// Why nothing could be measured.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum WorkPrecisionError {
    /// No element was given.
    NoElements,
    /// No step size was given.
    NoSteps,
    /// An element does not exist: an impossible number of nodes, or a quadrature that its family does not have.
    Element(ElementError),
    /// The span is empty, or its ends are not finite.
    Span {
        /// The start asked for.
        start: f64,
        /// The end asked for.
        end: f64,
    },
    /// A step size is zero, infinite or not a number.
    Step {
        /// The step asked for.
        step: f64,
    },
    /// The span holds more steps than can be counted.
    TooManySteps {
        /// Length of the span.
        span: f64,
        /// The step asked for.
        step: f64,
    },
    /// A tolerance is not a number from 0 to below 1.
    Tolerance {
        /// The tolerance given.
        tolerance: f64,
    },
    /// The uncertainty of the reference is not a finite number of at least zero.
    Uncertainty {
        /// The uncertainty given.
        uncertainty: f64,
    },
    /// No run can begin at this start.
    Start(RunErrorKind),
    /// The reference run failed with every step size.
    ReferenceRun(RunErrorKind),
    /// The reference that was given is not finite.
    ReferenceValue {
        /// The time of that state.
        time: f64,
    },
    /// The length of a vector of the reference that was given differs from that of the model.
    ReferenceLength {
        /// `q` or `p`.
        vector: &'static str,
        /// The time of that state.
        time: f64,
        /// The length of that vector.
        length: usize,
        /// The number of coordinates.
        expected: usize,
    },
}

impl fmt::Display for WorkPrecisionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoElements => {
                f.write_str("there is no element to measure; add some with `.element(…)`")
            }
            Self::NoSteps => {
                f.write_str("there is no step to measure; add some with `.steps([…])`")
            }
            Self::Element(error) => error.fmt(f),
            Self::Span { start, end } => write!(
                f,
                "the span {}..{} is empty, or has an end or a length that is not finite",
                Short(*start),
                Short(*end)
            ),
            Self::Step { step } => {
                write!(
                    f,
                    "a step is {}, but it must be finite and not zero",
                    Short(*step)
                )
            }
            Self::TooManySteps { span, step } => {
                let (span, step) = (Short(*span), Short(*step));
                write!(
                    f,
                    "a span of {span} holds too many steps of {step}: choose longer steps, or a shorter span"
                )
            }
            Self::Tolerance { tolerance } => write!(f, "{}", WrongTolerance(*tolerance)),
            Self::Uncertainty { uncertainty } => write!(
                f,
                "the uncertainty of the reference is {}, but it must be finite and at least 0",
                Short(*uncertainty)
            ),
            Self::Start(kind) => kind.fmt(f),
            Self::ReferenceRun(kind) => write!(
                f,
                "there is nothing to compare with: the reference run failed, {kind}; give a `.reference(…)`"
            ),
            Self::ReferenceValue { time } => {
                write!(f, "the reference at t = {} is not finite", Short(*time))
            }
            Self::ReferenceLength {
                vector,
                time,
                length,
                expected,
            } => write!(
                f,
                "the vector {vector} of the reference at t = {} has {length} elements, but the model has {expected} coordinates",
                Short(*time)
            ),
        }
    }
}

impl Error for WorkPrecisionError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Element(error) => Some(error),
            Self::Start(kind) | Self::ReferenceRun(kind) => Some(kind),
            _ => None,
        }
    }
}

/// Why measurements could not be written.
#[derive(Debug)]
#[non_exhaustive]
pub enum SaveError {
    /// The file could not be written.
    Io {
        /// The path of the file.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// The ending of the file name is not one of the supported formats.
    UnknownEnding {
        /// The path of the file.
        path: PathBuf,
        /// The supported endings.
        known: &'static [&'static str],
    },
    /// Pictures and pages need the feature `charts`.
    NoCharts {
        /// The path of the file.
        path: PathBuf,
    },
    /// The picture could not be made.
    #[cfg(feature = "charts")]
    Chart(ChartError),
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { path, source } => write!(f, "cannot write {}: {source}", path.display()),
            Self::UnknownEnding { path, known } => write!(
                f,
                "cannot tell what to write into {}: its name should end in {}",
                path.display(),
                known.join(" or ")
            ),
            Self::NoCharts { path } => write!(
                f,
                "{} would be a picture, and this program was built without the feature `charts`: enable it, or save numbers as `.csv`",
                path.display()
            ),
            #[cfg(feature = "charts")]
            Self::Chart(error) => error.fmt(f),
        }
    }
}

impl Error for SaveError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            #[cfg(feature = "charts")]
            Self::Chart(error) => Some(error),
            _ => None,
        }
    }
}

#[cfg(feature = "charts")]
impl From<ChartError> for SaveError {
    fn from(error: ChartError) -> Self {
        Self::Chart(error)
    }
}
