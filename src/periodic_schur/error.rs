//! The errors of the periodic Schur decomposition.

use std::error::Error;
use std::fmt;
use tfe_runtime::StepError;

/// Why the eigenvalues of a product were not found. Factors are counted from 0, in the order in which they were given.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PeriodicSchurError {
    /// The list of factors is empty.
    Empty,
    /// The constraints of the model do not allow the same number of independent motions at all nodes, or no velocity
    /// belongs to the momenta at one: there are no transition matrices on the constraints.
    Constraints(StepError),
    /// A slice does not hold a whole number of factors.
    Length {
        /// The number of rows of a factor.
        order: usize,
        /// The length of the slice.
        found: usize,
    },
    /// A factor is not square.
    NotSquare {
        /// The index of the factor.
        index: usize,
        /// Its number of rows.
        rows: usize,
        /// Its number of columns.
        columns: usize,
    },
    /// A factor differs in size from the first.
    SizeMismatch {
        /// The index of the factor.
        index: usize,
        /// Its number of rows.
        found: usize,
        /// The number of rows of the first factor.
        expected: usize,
    },
    /// A factor holds an entry that is infinite or not a number, or, for [`PeriodicSchur`](super::PeriodicSchur), its
    /// triangular form would.
    NonFinite {
        /// The index of the factor.
        index: usize,
    },
    /// The QR iteration did not converge for a diagonal block.
    NoConvergence {
        /// The first row of the block, from 0.
        first: usize,
        /// The last row of the block.
        last: usize,
        /// The number of QR steps taken on it.
        iterations: u32,
    },
}

impl fmt::Display for PeriodicSchurError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the product has no factor"),
            Self::Constraints(source) => write!(
                f,
                "the motions that the constraints allow cannot be found at all nodes: {source}"
            ),
            Self::Length { order, found } => {
                write!(
                    f,
                    "{found} entries are not a whole number of {order} × {order} factors"
                )
            }
            Self::NotSquare {
                index,
                rows,
                columns,
            } => {
                write!(
                    f,
                    "factor {index} is {rows} × {columns}, but it must be square"
                )
            }
            Self::SizeMismatch {
                index,
                found,
                expected,
            } => {
                write!(
                    f,
                    "factor {index} is {found} × {found}, but the first is {expected} × {expected}"
                )
            }
            Self::NonFinite { index } => {
                write!(f, "factor {index} holds an entry that is not finite")
            }
            Self::NoConvergence {
                first,
                last,
                iterations,
            } => {
                write!(
                    f,
                    "the QR iteration did not separate the eigenvalues of rows {first} to {last} in {iterations} steps"
                )
            }
        }
    }
}

impl Error for PeriodicSchurError {}
