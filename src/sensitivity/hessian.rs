//! Second derivatives of losses.

use crate::length::{FixedLength, Length};
use crate::sensitivity::loss::LossGradient;
use nalgebra::DMatrix;

/// The second derivatives of a loss with respect to some parameters, from
/// [`Simulation::hessian`](crate::Simulation::hessian).
#[derive(Clone, Debug)]
pub struct LossHessian<const N: usize, L: Length<N> = FixedLength> {
    value: f64,
    gradient: LossGradient<N, L>,
    names: Vec<String>,
    matrix: DMatrix<f64>,
    errors: DMatrix<f64>,
}

impl<const N: usize, L: Length<N>> LossHessian<N, L> {
    /// From the derivatives of the gradient, a column for each parameter, and their error estimates.
    pub(crate) fn new(
        (value, gradient): (f64, LossGradient<N, L>),
        names: Vec<String>,
        columns: &DMatrix<f64>,
        errors: &DMatrix<f64>,
    ) -> Self {
        let size = names.len();
        let matrix = DMatrix::from_fn(size, size, |i, j| 0.5 * (columns[(i, j)] + columns[(j, i)]));
        let errors = DMatrix::from_fn(size, size, |i, j| {
            let apart = (columns[(i, j)] - columns[(j, i)]).abs();
            apart.max(errors[(i, j)]).max(errors[(j, i)])
        });
        Self {
            value,
            gradient,
            names,
            matrix,
            errors,
        }
    }

    /// The value of the loss.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// The gradient of the loss with respect to all parameters and the start, with the motion.
    pub fn gradient(&self) -> &LossGradient<N, L> {
        &self.gradient
    }

    /// The parameters that were asked for, in that order.
    pub fn parameters(&self) -> &[String] {
        &self.names
    }

    /// The second derivative ∂²ℓ/∂a∂b with respect to two parameters.
    ///
    /// # Panics
    /// If one of the names was not asked for; [`get`](Self::get) returns `None` instead.
    #[track_caller]
    pub fn by(&self, a: &str, b: &str) -> f64 {
        let Some(derivative) = self.get(a, b) else {
            panic!(
                "the derivative with respect to `{a}` and `{b}` was not asked for, only those with respect to `{}`",
                self.names.join("`, `")
            )
        };
        derivative
    }

    /// The second derivative ∂²ℓ/∂a∂b with respect to two parameters; `None` if one of the names was not asked for.
    pub fn get(&self, a: &str, b: &str) -> Option<f64> {
        let place = |name: &str| self.names.iter().position(|own| own == name);
        Some(self.matrix[(place(a)?, place(b)?)])
    }

    /// The matrix of all second derivatives: symmetric, rows and columns in the order of
    /// [`parameters`](Self::parameters).
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Estimates of the absolute errors of [`matrix`](Self::matrix): the difference between formulas of eighth and of
    /// sixth order, the effect of rounding in the gradients, and the difference between ∂²ℓ/∂a∂b and ∂²ℓ/∂b∂a.
    pub fn errors(&self) -> &DMatrix<f64> {
        &self.errors
    }
}
