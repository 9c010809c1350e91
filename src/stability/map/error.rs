//! The errors of a stability map and of its points.

use crate::numbers::Short;
use crate::stability::eigenvalues::EigenvalueError;
use std::error::Error;
use std::fmt;
use std::io;
use std::path::PathBuf;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{ElementError, StepError};

/// Why a stability map, or a file of it, could not be made.
#[derive(Debug)]
#[non_exhaustive]
pub enum MapError {
    /// The map has no cells, or too many.
    Resolution {
        /// The number of cells in the direction of x asked for.
        columns: usize,
        /// The number of cells in the direction of y asked for.
        rows: usize,
    },
    /// The ends of a range are not finite or not ascending.
    Range {
        /// The label of the parameter.
        label: String,
        /// The start asked for.
        start: f64,
        /// The end asked for.
        end: f64,
    },
    /// The value above which cells are unstable is not a number.
    Limit,
    /// The element does not exist: an impossible number of nodes, or a quadrature that this family does not have.
    Element(ElementError),
    /// The period is not positive and finite, the number of elements is zero or more than ten million, or the elements
    /// are so short that their length is below all normal numbers.
    Period {
        /// The period asked for.
        period: f64,
        /// The number of elements asked for.
        elements: usize,
    },
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
    /// The picture could not be made.
    #[cfg(feature = "charts")]
    Chart(crate::charts::ChartError),
}

#[cfg(feature = "charts")]
impl From<crate::charts::ChartError> for MapError {
    fn from(error: crate::charts::ChartError) -> Self {
        Self::Chart(error)
    }
}

impl fmt::Display for MapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Resolution { columns, rows } => write!(
                f,
                "a map cannot have {columns} × {rows} cells: at least one, at most 2²⁸"
            ),
            Self::Range { label, start, end } => {
                let (start, end) = (Short(*start), Short(*end));
                write!(
                    f,
                    "`{label}` cannot go from {start} to {end}: both must be finite, the end above the start"
                )
            }
            Self::Limit => f.write_str(
                "the value above which cells are unstable is not a number: leave `.limit(…)` out, or give a number near 1",
            ),
            Self::Element(error) => error.fmt(f),
            Self::Period { period, elements } => {
                let period = Short(*period);
                write!(
                    f,
                    "a period of {period} in {elements} elements: the period must be positive and finite, the elements at least one, at most ten million"
                )
            }
            Self::Io { path, source } => write!(f, "cannot write {}: {source}", path.display()),
            Self::UnknownEnding { path, known } => {
                let known = known.join(" or ");
                write!(
                    f,
                    "cannot tell what to write into {}: its name should end in {known}",
                    path.display()
                )
            }
            #[cfg(feature = "charts")]
            Self::Chart(error) => error.fmt(f),
        }
    }
}

impl Error for MapError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Element(error) => Some(error),
            Self::Io { source, .. } => Some(source),
            #[cfg(feature = "charts")]
            Self::Chart(error) => Some(error),
            _ => None,
        }
    }
}

/// A cell without a value: where, and why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointFailure<E> {
    /// Its column, from 0 at the smallest x.
    pub column: usize,
    /// Its row, from 0 at the smallest y.
    pub row: usize,
    /// x at the centre of the cell.
    pub x: f64,
    /// y at the centre of the cell.
    pub y: f64,
    /// Why there is no value.
    pub error: PointError<E>,
}

/// Why a cell has no value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointError<E> {
    /// The value is infinite or not a number.
    NotFinite {
        /// The value: infinite or NaN.
        value: f64,
    },
    /// The value could not be computed.
    Failed(E),
}

impl<E: fmt::Display> fmt::Display for PointError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { value } => write!(f, "the result is {value}"),
            Self::Failed(error) => error.fmt(f),
        }
    }
}

impl<E: Error + 'static> Error for PointError<E> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::NotFinite { .. } => None,
            Self::Failed(error) => Some(error),
        }
    }
}

impl<E: fmt::Display> fmt::Display for PointFailure<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (x, y) = (Short(self.x), Short(self.y));
        write!(f, "at ({x}, {y}): {}", self.error)
    }
}

impl<E: Error + 'static> Error for PointFailure<E> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        Some(&self.error)
    }
}

/// Why the Floquet multipliers of a model about its rest state could not be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FloquetError {
    /// An element could not be solved.
    Step {
        /// The number of the element in the period, from 0.
        element: usize,
        /// The cause.
        source: StepError,
    },
    /// An element has no transition matrix.
    Transition {
        /// The number of the element in the period, from 0.
        element: usize,
        /// The cause.
        source: TransitionError,
    },
    /// The rest state q = 0, p = 0 is not an equilibrium of the model: an element moved away from it.
    NotAtRest {
        /// The number of the element in the period, from 0.
        element: usize,
        /// The largest magnitude of a coordinate or momentum after that element, in the units of the model.
        distance: f64,
    },
    /// The eigenvalues of the monodromy matrix could not be computed.
    Eigenvalues(EigenvalueError),
}

impl fmt::Display for FloquetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Step { element, source } => write!(f, "element {element}: {source}"),
            Self::Transition { element, source } => write!(f, "element {element}: {source}"),
            Self::NotAtRest { element, distance } => write!(
                f,
                "the model does not stay at rest: after element {element} a coordinate or momentum is {distance:e}; count coordinates and momenta from an equilibrium"
            ),
            Self::Eigenvalues(error) => error.fmt(f),
        }
    }
}

impl Error for FloquetError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Step { source, .. } => Some(source),
            Self::Transition { source, .. } => Some(source),
            Self::Eigenvalues(error) => Some(error),
            Self::NotAtRest { .. } => None,
        }
    }
}
