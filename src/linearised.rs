//! Motions with the transition matrices of all elements.

use crate::length::{FixedLength, Length};
use crate::motion::Motion;
use crate::periodic_schur::{self, Multiplier, PeriodicSchurError};
use nalgebra::DMatrix;
use tfe_runtime::StepError;

/// A motion together with the transition matrices of its elements, made by
/// [`Simulation::run_linearised`](crate::Simulation::run_linearised).
///
/// With y = (p, q), and A_e the derivative of the end of element e with respect to its start,
///
/// ```text
/// δy_{e+1} = A_e δy_e ,      δy_end = A_{N−1} ⋯ A₁ A₀ δy_start .                                     (T-83)
/// ```
///
/// The matrices are the derivative of the computed motion, exact up to rounding; they do not approximate the
/// linearised differential equation separately.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + k*cos(theta))]
/// struct Pendulum { k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let pendulum = Pendulum { k: 1.0 };
/// let simulation = Simulation::new(&pendulum).step(0.1);
/// let run = simulation.run_linearised(pendulum.state([1.0], [0.0]), 0.0..5.0)?;
/// let product = run.product();
///
/// // One of the four: how the angle at the end depends on the angle at the start.
/// let end = |angle| -> Result<f64, tfe::RunError<1>> {
///     Ok(simulation.run(pendulum.state([angle], [0.0]), 0.0..5.0)?.last().q[0])
/// };
/// let difference = (end(1.0 + 1e-4)? - end(1.0 - 1e-4)?) / 2e-4;
/// assert!((product[(1, 1)] - difference).abs() < 1e-6);
/// assert!(stability::symplecticity_defect(&product) < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Linearised<const N: usize, L: Length<N> = FixedLength> {
    motion: Motion<N, L>,
    transitions: Vec<DMatrix<f64>>,
    /// The matrices restricted to the motions that constraints allow, for models with constraints; the identity for an
    /// empty span.
    reduced: Option<Result<Vec<DMatrix<f64>>, StepError>>,
}

impl<const N: usize, L: Length<N>> Linearised<N, L> {
    /// Adds the matrices restricted to the motions that constraints allow, if there are constraints.
    pub(crate) fn with(
        motion: Motion<N, L>,
        transitions: Vec<DMatrix<f64>>,
        reduced: Option<Result<Vec<DMatrix<f64>>, StepError>>,
    ) -> Self {
        Self {
            motion,
            transitions,
            reduced,
        }
    }

    /// The number of coordinates and momenta.
    fn size(&self) -> usize {
        2 * self.motion.last().p.as_ref().len()
    }

    /// The motion.
    pub fn motion(&self) -> &Motion<N, L> {
        &self.motion
    }

    /// The transition matrices, one for each element in the order of the run, 2N × 2N each, ordered (p, q).
    ///
    /// There is one for every element, even if [`record_every`](crate::Simulation::record_every) keeps only some of
    /// the nodes.
    pub fn transitions(&self) -> &[DMatrix<f64>] {
        &self.transitions
    }

    /// For a model with constraints, the transition matrices restricted to the variations that the constraints allow;
    /// `None` for models without constraints, and if there is no basis.
    ///
    /// Each matrix is in the orthonormal bases [`tangent_basis`](crate::constraints::tangent_basis) at the two nodes
    /// of its element, so that no direction violates a constraint and no zero eigenvalue belongs to one. If the motion
    /// is periodic, the last matrix leads back to the basis of the start.
    pub fn on_constraints(&self) -> Option<&[DMatrix<f64>]> {
        let reduced = self.reduced.as_ref()?.as_deref().ok()?;
        reduced.get(..self.transitions.len())
    }

    /// The motion and the transition matrices, by value.
    pub fn into_parts(self) -> (Motion<N, L>, Vec<DMatrix<f64>>) {
        (self.motion, self.transitions)
    }

    /// The derivative of the end of the motion with respect to its start, 2N × 2N, ordered (p, q): the product of all
    /// transition matrices, the first one on the right; the identity for an empty span.
    ///
    /// Over one period of a periodic motion it is the monodromy matrix.
    ///
    /// # Not guaranteed
    /// If some directions grow and others decay by more than ten orders of magnitude relative to each other, rounding
    /// leaves only the growing ones in the product; beyond 10³⁰⁸ its entries are infinite or NaN. Use
    /// [`multipliers`](Self::multipliers), which does not form the product.
    pub fn product(&self) -> DMatrix<f64> {
        let identity = DMatrix::identity(self.size(), self.size());
        (self.transitions.iter()).fold(identity, |product, a| a * product)
    }

    /// The eigenvalues of the [`product`](Self::product), in order of decreasing modulus, computed without forming it
    /// (periodic Schur form): very small eigenvalues beside very large ones keep their digits, and there is no
    /// overflow or underflow.
    ///
    /// Over one period of a periodic motion these are its Floquet multipliers. Over any other span they depend on the
    /// coordinates and have no such meaning.
    ///
    /// For a model with constraints, the eigenvalues are those of the motions that the constraints allow, from
    /// [`on_constraints`](Self::on_constraints).
    ///
    /// # Errors
    /// [`PeriodicSchurError::NonFinite`] if a matrix is not finite, [`NoConvergence`](PeriodicSchurError::NoConvergence) if
    /// the iteration does not converge, [`Constraints`](PeriodicSchurError::Constraints) if there are no matrices
    /// [on the constraints](Self::on_constraints).
    ///
    /// # Example
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + x^2/2)]
    /// struct Saddle {}
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let run = Simulation::new(&Saddle {}).step(0.1).run_linearised(Saddle {}.state([0.0], [0.0]), 0.0..1000.0)?;
    /// let multipliers = run.multipliers()?; // e^±1000, with an error of h⁷/100800 = 1e-12 in each of 10 000 steps
    /// assert!((multipliers[0].log_modulus - 1000.0).abs() < 1e-7);
    /// assert!((multipliers[1].log_modulus + 1000.0).abs() < 1e-7);
    /// # Ok(())
    /// # }
    /// ```
    pub fn multipliers(&self) -> Result<Vec<Multiplier>, PeriodicSchurError> {
        match &self.reduced {
            Some(Ok(reduced)) => return periodic_schur::multipliers(reduced),
            Some(Err(error)) => return Err(PeriodicSchurError::Constraints(*error)),
            None => {}
        }
        if self.transitions.is_empty() {
            let identity = DMatrix::identity(self.size(), self.size());
            return periodic_schur::multipliers(&[identity]);
        }
        periodic_schur::multipliers(&self.transitions)
    }
}
