//! The four blocks of a matrix on phase space.

use nalgebra::{DMatrix, DMatrixView};

/// Names for the four blocks of a transition matrix or monodromy matrix, whose rows and columns are ordered (p, q):
///
/// ```text
/// A = [ ∂p₁/∂p₀   ∂p₁/∂q₀ ]
///     [ ∂q₁/∂p₀   ∂q₁/∂q₀ ]                                                                (docs/theory.md (T-30))
/// ```
///
/// Each block is N × N, for a matrix of 2N × 2N, and a view without a copy. Derivatives with respect to initial
/// velocities are those with respect to initial momenta times the mass matrix: ∂q₁/∂v₀ = ∂q₁/∂p₀ M.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
/// struct Oscillator { m: f64, k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let oscillator = Oscillator { m: 2.0, k: 8.0 };
/// let state = oscillator.state([0.1], [0.0]);
/// let a = stability::transition_matrix(&oscillator, Mixed::<6>, &state, 0.0, 0.1)?;
/// // x = x₀ cos 2t + p₀ sin 2t / 4,   p = −4 x₀ sin 2t + p₀ cos 2t
/// let (s, c) = 0.2_f64.sin_cos();
/// assert!((a.q_by_q()[(0, 0)] - c).abs() < 1e-14);
/// assert!((a.q_by_p()[(0, 0)] - s / 4.0).abs() < 1e-14);
/// assert!((a.p_by_q()[(0, 0)] + 4.0 * s).abs() < 1e-14);
/// assert!((a.p_by_p()[(0, 0)] - c).abs() < 1e-14);
/// # Ok(())
/// # }
/// ```
pub trait Blocks {
    /// ∂p₁/∂p₀.
    fn p_by_p(&self) -> DMatrixView<'_, f64>;
    /// ∂p₁/∂q₀.
    fn p_by_q(&self) -> DMatrixView<'_, f64>;
    /// ∂q₁/∂p₀.
    fn q_by_p(&self) -> DMatrixView<'_, f64>;
    /// ∂q₁/∂q₀.
    fn q_by_q(&self) -> DMatrixView<'_, f64>;
}

impl Blocks for DMatrix<f64> {
    fn p_by_p(&self) -> DMatrixView<'_, f64> {
        block(self, (0, 0))
    }

    fn p_by_q(&self) -> DMatrixView<'_, f64> {
        block(self, (0, 1))
    }

    fn q_by_p(&self) -> DMatrixView<'_, f64> {
        block(self, (1, 0))
    }

    fn q_by_q(&self) -> DMatrixView<'_, f64> {
        block(self, (1, 1))
    }
}

/// A quarter of a matrix, whatever its shape.
fn block(matrix: &DMatrix<f64>, (row, column): (usize, usize)) -> DMatrixView<'_, f64> {
    let (rows, columns) = (matrix.nrows() / 2, matrix.ncols() / 2);
    matrix.view((row * rows, column * columns), (rows, columns))
}
