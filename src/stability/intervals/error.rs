//! The errors of the search for intervals.

use crate::numbers::Short;
use std::error::Error;
use std::fmt;

/// Why unstable intervals could not be found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum IntervalError<E> {
    /// The range is empty, reversed or not finite.
    Range {
        /// The start asked for.
        start: f64,
        /// The end asked for.
        end: f64,
    },
    /// The matrix could not be computed.
    Matrix {
        /// The parameter.
        at: f64,
        /// The cause.
        source: E,
    },
    /// The matrix is empty, not square, or differs in size from the matrix at other parameters.
    Shape {
        /// The parameter.
        at: f64,
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// An entry of the matrix is not finite.
    NotFinite {
        /// The parameter.
        at: f64,
    },
    /// The eigenvalues of the matrix did not converge.
    Eigenvalues {
        /// The parameter.
        at: f64,
    },
    /// The matrix is not smooth enough in the parameter: it was still not resolved after the largest number of
    /// evaluations.
    Unresolved {
        /// Where the last evaluation was.
        near: f64,
        /// The number of evaluations made.
        evaluations: usize,
    },
}

impl<E: fmt::Display> fmt::Display for IntervalError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range { start, end } => {
                write!(
                    f,
                    "the range {start}..{end} is empty or not finite: give two finite ends, in ascending order",
                    start = Short(*start),
                    end = Short(*end)
                )
            }
            Self::Matrix { at, source } => {
                write!(f, "no transition matrix at {at}: {source}", at = Short(*at))
            }
            Self::Shape { at, rows, columns } => {
                write!(
                    f,
                    "the matrix at {at} is {rows} × {columns}: expected a square matrix of one size everywhere",
                    at = Short(*at)
                )
            }
            Self::NotFinite { at } => {
                write!(
                    f,
                    "the matrix at {at} has an entry that is not finite",
                    at = Short(*at)
                )
            }
            Self::Eigenvalues { at } => {
                write!(
                    f,
                    "the eigenvalues of the matrix at {at} did not converge",
                    at = Short(*at)
                )
            }
            Self::Unresolved { near, evaluations } => {
                write!(
                    f,
                    "the matrix is not smooth near {near}: unresolved after {evaluations} evaluations; leave that place out of the range",
                    near = Short(*near)
                )
            }
        }
    }
}

impl<E: Error + 'static> Error for IntervalError<E> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Matrix { source, .. } => Some(source),
            _ => None,
        }
    }
}
