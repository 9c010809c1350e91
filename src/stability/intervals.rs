//! All intervals of a parameter in which the spectral radius of a transition matrix exceeds one.
//!
//! A grid of spectral radii cannot find intervals of width 10⁻⁵, and the radius behaves like a square root at their
//! ends. The search therefore uses smooth functions of the matrix that change sign where stability changes;
//! `sign_functions` lists them.
//!
//! The functions are interpolated piecewise at Chebyshev points until resolved (`pieces`). Between successive critical
//! points of the interpolant a function is monotonic; a change of sign is one root, which is refined with the function
//! itself. An apparent double zero is magnified and interpolated again, down to rounding error. All roots together
//! divide the range; the spectral radius inside the parts tells which are unstable (`changes`), and golden-section
//! search finds its maximum (`worst`).

mod changes;
mod error;
mod pieces;
mod search;
#[cfg(test)]
mod tests;
mod worst;

pub use error::IntervalError;

use nalgebra::DMatrix;
use search::{Failure, Search, Withheld};
use std::ops::Range;

/// An interval of a parameter (such as the step size) in which the spectral radius exceeds one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnstableInterval {
    /// The start of the interval; the start of the range if it is unstable there already.
    pub start: f64,
    /// The end of the interval; the end of the range if it is still unstable there.
    pub end: f64,
    /// The largest spectral radius in the interval; infinite at a pole of the matrix.
    pub radius: f64,
    /// The parameter at which the largest spectral radius is attained.
    pub worst: f64,
}

/// All intervals of `range` in which the spectral radius of `matrix`, a function of one parameter, exceeds one; in
/// ascending order.
///
/// The matrix must be a smooth function of the parameter, as the transition matrix of an element is of its length;
/// poles are allowed. The ends of the intervals are found by root finding, in general to a relative accuracy of 10⁻¹²,
/// or as far as rounding in the matrix permits. Adjacent intervals are reported as one. Not reported are a radius that
/// only touches one, an excess ρ − 1 below 10⁻¹⁰, and an excess that perturbations of the matrix by 256 ε (ε =
/// 2.2·10⁻¹⁶, relative to the size of each entry nearby) could explain.
///
/// A range may begin at zero, where a transition matrix is the identity: the matrix is not evaluated there.
///
/// The cost is about a thousand evaluations of the matrix for one or two modes over a few unstable intervals, and tens
/// of thousands for many modes that cross many times. More than 200 000 are an error.
///
/// # Not guaranteed
/// Modes that coincide for every parameter make ∏ (μᵢ − μⱼ)² vanish; a collision of other eigenvalues away from ±1 is
/// then noticed only if one of some hundred samples falls into its interval.
/// # Errors
/// [`IntervalError::Range`] for a range that is empty or not finite; [`Matrix`](IntervalError::Matrix),
/// [`Shape`](IntervalError::Shape), [`NotFinite`](IntervalError::NotFinite) or
/// [`Eigenvalues`](IntervalError::Eigenvalues) if the matrix at a parameter is missing, not square or of another size, not
/// finite, or without eigenvalues; [`Unresolved`](IntervalError::Unresolved) if it is not smooth.
///
/// ```
/// use nalgebra::DMatrix;
/// use std::convert::Infallible;
/// # use tfe::stability::unstable_intervals_of;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // The primal element with two nodes for the oscillator of unit frequency: stable below √12.
/// let element = |h: f64| {
///     let (r, d) = (h * h, 6.0 + h * h);
///     let diagonal = (6.0 - 2.0 * r) / d;
///     Ok::<_, Infallible>(DMatrix::from_row_slice(2, 2, &[diagonal, (r - 12.0) * h / (2.0 * d), 6.0 * h / d, diagonal]))
/// };
/// let intervals = unstable_intervals_of(element, 0.0..10.0)?;
/// assert_eq!(intervals.len(), 1);
/// assert!((intervals[0].start - 12.0_f64.sqrt()).abs() < 1e-14);
/// assert_eq!(intervals[0].end, 10.0);
/// # Ok(())
/// # }
/// ```
pub fn unstable_intervals_of<E>(
    matrix: impl FnMut(f64) -> Result<DMatrix<f64>, E>,
    range: Range<f64>,
) -> Result<Vec<UnstableInterval>, IntervalError<E>> {
    named(matrix, |matrix| {
        let mut search = Search::over(matrix, &range)?;
        let verdict = search.verdict(&range)?;
        let mut intervals = Vec::new();
        let mut unstable_since = verdict.unstable_at_start.then_some(range.start);
        for change in verdict.changes.into_iter().chain([range.end]) {
            match unstable_since.take() {
                Some(start) => intervals.push(search.worst_in(start, change, &range)?),
                None => unstable_since = Some(change),
            }
        }
        Ok(intervals)
    })
}

/// All parameters in `range` at which the spectral radius of `matrix` rises above one or returns to it, in ascending
/// order.
///
/// Examples are the limit speed of a spinning top, or the step size at which an element loses its stability. The
/// method, conditions and tolerances are those of [`unstable_intervals_of`]; the ends of the range are not included.
///
/// # Errors
/// As from [`unstable_intervals_of`].
///
/// ```
/// use nalgebra::DMatrix;
/// use std::convert::Infallible;
/// # use tfe::stability::stability_changes_of;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // One step of symplectic Euler for the oscillator of unit frequency: stable below h = 2.
/// let euler = |h: f64| Ok::<_, Infallible>(DMatrix::from_row_slice(2, 2, &[1.0, -h, h, 1.0 - h * h]));
/// let changes = stability_changes_of(euler, 0.0..100.0)?;
/// assert_eq!(changes.len(), 1);
/// assert!((changes[0] - 2.0).abs() < 1e-14);
/// # Ok(())
/// # }
/// ```
pub fn stability_changes_of<E>(
    matrix: impl FnMut(f64) -> Result<DMatrix<f64>, E>,
    range: Range<f64>,
) -> Result<Vec<f64>, IntervalError<E>> {
    named(matrix, |matrix| {
        Ok(Search::over(matrix, &range)?.verdict(&range)?.changes)
    })
}

/// Runs a search that does not depend on the error type of the matrix, and restores the error that ended it.
fn named<T, E>(
    mut matrix: impl FnMut(f64) -> Result<DMatrix<f64>, E>,
    search: impl FnOnce(&mut dyn FnMut(f64) -> Result<DMatrix<f64>, Withheld>) -> Result<T, Failure>,
) -> Result<T, IntervalError<E>> {
    let mut held = None;
    let mut withholding = |at: f64| {
        matrix(at).map_err(|source| {
            held = Some(source);
            Withheld
        })
    };
    let found = search(&mut withholding);
    found.map_err(|failure| match (failure, held) {
        (IntervalError::Matrix { at, .. }, Some(source)) => IntervalError::Matrix { at, source },
        // There is no error to restore: the search is unresolved there.
        (IntervalError::Matrix { at, .. }, None) => IntervalError::Unresolved {
            near: at,
            evaluations: 0,
        },
        (IntervalError::Range { start, end }, _) => IntervalError::Range { start, end },
        (IntervalError::Shape { at, rows, columns }, _) => {
            IntervalError::Shape { at, rows, columns }
        }
        (IntervalError::NotFinite { at }, _) => IntervalError::NotFinite { at },
        (IntervalError::Eigenvalues { at }, _) => IntervalError::Eigenvalues { at },
        (IntervalError::Unresolved { near, evaluations }, _) => {
            IntervalError::Unresolved { near, evaluations }
        }
    })
}
