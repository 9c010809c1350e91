//! Linear stability: transition matrices of steps, their eigenvalues, modes, and the step sizes at which a method is
//! unstable.

mod arnoldi;
mod blocks;
pub(crate) mod chebyshev;
mod eigenvalues;
pub(crate) mod growth;
mod intervals;
pub(crate) mod linear_model;
mod map;
mod modes;
mod schur_order;
mod sign_functions;
mod step;
mod time_scales;

pub use arnoldi::{Dominant, DominantError, Iteration, dominant_of};
pub use blocks::Blocks;
pub use eigenvalues::{EigenvalueError, eigenvalues};
pub use intervals::{IntervalError, UnstableInterval, stability_changes_of, unstable_intervals_of};
pub use linear_model::{LinearModel, LinearModelError};
pub use map::{FloquetError, MapError, MapPlan, PointError, PointFailure, StabilityMap};
pub use modes::{Mode, ModeError, ModeKind, modes};
pub use step::Transitions;
#[cfg(feature = "sparse")]
pub use step::{dominant, transition};
#[cfg(feature = "sparse")]
pub use tfe_runtime::family::{OperatorError, TransitionOperator};
pub use tfe_runtime::transition::TransitionError;
pub use time_scales::TimeScales;

use crate::numbers::largest;
use eigenvalues::largest_modulus;
use nalgebra::DMatrix;
use std::ops::Range;
use tfe_runtime::length::Declared;
use tfe_runtime::{Element, Model, State};

/// The transition matrix A of one element (time step): the derivative of the step map (p, q) ↦ (p, q) at `state`.
///
/// ```text
/// (δp₁, δq₁) = A (δp₀, δq₀)                                                          (theory.md (T-30), the paper's (27))
/// ```
///
/// With the feature `sparse` also for models of run-time length; for a long one use `transition`, which gives an
/// operator instead of a dense matrix.
///
/// # Shapes
/// 2N × 2N, ordered (p, q); [`Blocks`] names its four blocks.
/// # Errors
/// [`TransitionError::Element`] if the element does not exist, [`TransitionError::Step`] if the model does not pass its
/// check, or the element cannot be solved or has a singular tangent. For models of run-time length
/// `family::OperatorError`, with the same meanings.
///
/// # Example
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
/// struct Oscillator { m: f64, k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let oscillator = Oscillator { m: 1.0, k: 1.0 };
/// let rest = oscillator.state([0.0], [0.0]);
/// let stable = stability::transition_matrix(&oscillator, Primal::<2>, &rest, 0.0, 3.4)?;
/// let unstable = stability::transition_matrix(&oscillator, Primal::<2>, &rest, 0.0, 3.5)?; // the limit is √12
/// assert!(stability::spectral_radius(&stable) < 1.0 + 1e-12);
/// assert!(stability::spectral_radius(&unstable) > 1.1);
/// # Ok(())
/// # }
/// ```
pub fn transition_matrix<M, const N: usize>(
    model: &M,
    element: impl Into<Element>,
    state: &<M::Length as Transitions<M, N>>::State,
    t: f64,
    h: f64,
) -> Result<DMatrix<f64>, <M::Length as Transitions<M, N>>::Error>
where
    M: Declared<N, Length: Transitions<M, N>>,
{
    Ok(M::Length::step(model, element.into(), state, t, h)?.0)
}

/// The transition matrix of one element restricted to the variations that the constraints of the model allow, in the
/// orthonormal bases [`tangent_basis`](crate::constraints::tangent_basis) B₀ and B₁ at the two ends of the element,
///
/// ```text
/// B₁ᵀ A B₀                                                                (theory.md (T-78))
/// ```
///
/// No direction violates a constraint, and no zero eigenvalue belongs to one. If the same variations are allowed at
/// both ends (within √ε, as at an equilibrium known up to rounding), B₁ is B₀, and the eigenvalues are those of the
/// motion. Elsewhere, multiply the matrices along the motion, as
/// [`Linearised::multipliers`](crate::Linearised::multipliers) does.
///
/// # Shapes
/// 2N − 2a − b rows and columns, with a independent holonomic constraints and b others.
/// # Errors
/// As from [`transition_matrix`]; also if no velocity belongs to the momenta at an end.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - y, constraint(rod) = x^2 + y^2 - 1)]
/// struct Pendulum {}
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let hanging = Pendulum {}.state([0.0, -1.0], [0.0, 0.0]);
/// let a = stability::on_constraints(&Pendulum {}, Mixed::<6>, &hanging, 0.0, 0.1)?;
/// // One oscillation of frequency one: eigenvalues e^±0.1i.
/// assert_eq!(a.shape(), (2, 2));
/// assert!((a.trace() - 2.0 * 0.1_f64.cos()).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
pub fn on_constraints<M, const N: usize>(
    model: &M,
    element: impl Into<Element>,
    state: &<M::Length as Transitions<M, N>>::State,
    t: f64,
    h: f64,
) -> Result<DMatrix<f64>, <M::Length as Transitions<M, N>>::Error>
where
    M: Declared<N, Length: Transitions<M, N>>,
{
    let (matrix, end) = M::Length::step(model, element.into(), state, t, h)?;
    let before = M::Length::basis(model, t, state)?;
    let after = M::Length::basis(model, t + h, &end)?;
    let after = if spans_the_same(&before, &after) {
        &before
    } else {
        &after
    };
    Ok(after.tr_mul(&(matrix * &before)))
}

/// Whether two orthonormal bases span the same space. Rounding errors of a state may lead to another basis; a matrix
/// from one basis to another would have other eigenvalues.
///
/// The tolerance √ε changes a matrix by ε if one basis replaces the other.
fn spans_the_same(one: &DMatrix<f64>, other: &DMatrix<f64>) -> bool {
    one.shape() == other.shape() && (other - one * one.tr_mul(other)).amax() <= f64::EPSILON.sqrt()
}

/// All intervals of the step size in which the method is unstable about an equilibrium: ascending and disjoint.
///
/// With A(h) the transition matrix of one element of length h about the equilibrium at t = 0, these are the h in
/// `steps` with
///
/// ```text
/// ρ(A(h)) > 1 ,     ρ = max |λ| ;
/// ```
///
/// If the model itself is stable, the method fails at these step sizes. Primal elements have such intervals near half
/// periods of every mode (the paper's "bubbles"), and are unstable beyond a last limit; mixed elements have none. A
/// model that is itself unstable, such as an inverted pendulum, is so for all small steps.
///
/// The ends of the intervals are located by root finding, to a relative accuracy of about 10⁻¹². See
/// [`unstable_intervals_of`] for the method, its tolerances and its cost (some thousand transition matrices). `steps`
/// may begin at zero. For stability as a function of another parameter than the step size (a speed, a stiffness), use
/// that function with [`transition_matrix`].
///
/// # Not guaranteed
/// `equilibrium` is not checked: elsewhere A is the derivative of one step from there, and says little about the next
/// one. For a model that depends on time, only the element at t = 0 is examined.
/// # Errors
/// [`IntervalError::Range`] for an empty range; [`IntervalError::Matrix`] if there is no transition matrix, with the
/// reason; [`IntervalError::Unresolved`] for a model that is not smooth at the equilibrium.
/// # Reference
/// theory.md (T-57), the intervals of the oscillator.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
/// struct Oscillator { m: f64, k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let oscillator = Oscillator { m: 1.0, k: 1.0 };
/// let rest = oscillator.state([0.0], [0.0]);
/// let gaps = stability::unstable_intervals(&oscillator, Primal::<3>, &rest, 0.0..30.0)?;
/// for gap in &gaps {
///     println!("{} .. {}: radius up to {} at {}", gap.start, gap.end, gap.radius, gap.worst);
/// }
/// assert_eq!(gaps.len(), 2); // √10 … √12, and beyond √60
/// assert!((gaps[0].start - 10.0_f64.sqrt()).abs() < 1e-12 && (gaps[0].end - 12.0_f64.sqrt()).abs() < 1e-12);
/// assert!((gaps[1].start - 60.0_f64.sqrt()).abs() < 1e-12 && gaps[1].end == 30.0);
///
/// assert!(stability::unstable_intervals(&oscillator, Mixed::<3>, &rest, 0.0..30.0)?.is_empty());
/// # Ok(())
/// # }
/// ```
pub fn unstable_intervals<M: Model<N>, const N: usize>(
    model: &M,
    element: impl Into<Element>,
    equilibrium: &State<N>,
    steps: Range<f64>,
) -> Result<Vec<UnstableInterval>, IntervalError<TransitionError>> {
    let element = element.into();
    let matrix = |h| {
        if const { M::CONSTRAINTS.is_empty() } {
            transition_matrix(model, element, equilibrium, 0.0, h)
        } else {
            // The directions that the constraints exclude have zero eigenvalues, which are no modes.
            on_constraints(model, element, equilibrium, 0.0, h)
        }
    };
    unstable_intervals_of(matrix, steps)
}

/// The spectral radius of a square matrix: the largest modulus of an eigenvalue, max |λ|; zero for an empty matrix.
///
/// NaN if [`eigenvalues()`] returns an error: if the matrix is not square, an entry is not finite, or the iteration
/// does not converge.
pub fn spectral_radius(matrix: &DMatrix<f64>) -> f64 {
    eigenvalues(matrix).map_or(f64::NAN, |values| largest_modulus(&values))
}

/// The distance of a transition matrix from being symplectic: the largest entry of |AᵀJA − J|, with J = [[0, −1], [1,
/// 0]] in the order (p, q) (theory.md (T-2)).
///
/// Zero up to rounding for symplectic elements and models without forces. NaN for a matrix that is not square, has an
/// odd size or an entry that is NaN.
pub fn symplecticity_defect(matrix: &DMatrix<f64>) -> f64 {
    let size = matrix.nrows();
    if !matrix.is_square() || !size.is_multiple_of(2) {
        return f64::NAN;
    }
    let n = size / 2;
    let j = DMatrix::from_fn(size, size, |row, column| {
        if column == row + n {
            -1.0
        } else if row == column + n {
            1.0
        } else {
            0.0
        }
    });
    let difference = matrix.transpose() * &j * matrix - j;
    largest(difference.as_slice())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn spectra_of_small_matrices() {
        let rotation = DMatrix::from_row_slice(2, 2, &[0.6, -0.8, 0.8, 0.6]);
        assert_abs_diff_eq!(spectral_radius(&rotation), 1.0, epsilon = f64::EPSILON);
        assert!(symplecticity_defect(&rotation) <= 2.0 * f64::EPSILON);
        let stretch = DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, -3.0]);
        assert_eq!(spectral_radius(&stretch), 3.0);
        assert_eq!(symplecticity_defect(&stretch), 7.0);
        let broken = DMatrix::from_row_slice(2, 2, &[f64::NAN, 0.0, 0.0, 1.0]);
        assert!(spectral_radius(&broken).is_nan());
        assert!(symplecticity_defect(&broken).is_nan());
    }
}
