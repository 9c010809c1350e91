//! Transition matrices for models of either kind of length, and transition operators for long models.

use nalgebra::DMatrix;
use std::error::Error;
use tfe_runtime::length::FixedLength;
use tfe_runtime::transition::{self, TransitionError};
use tfe_runtime::{Element, Model, State};

use crate::constraints::tangent_basis;

#[cfg(feature = "sparse")]
use super::arnoldi::{Dominant, DominantError, Iteration, dominant_of};
#[cfg(feature = "sparse")]
use crate::constraints::allowed::basis_of;
#[cfg(feature = "sparse")]
use tfe_runtime::family::{self, FamilyState};
#[cfg(feature = "sparse")]
use tfe_runtime::length::RunTimeLength;

/// How the transition matrix is computed for models of one kind of length; the interface behind
/// [`transition_matrix`](super::transition_matrix).
#[cfg_attr(
    not(feature = "sparse"),
    diagnostic::on_unimplemented(
        message = "transition matrices of models of run-time length need the feature `sparse`"
    )
)]
pub trait Transitions<M, const N: usize> {
    /// The type of a state (q, p).
    type State;
    /// The error if there is no transition matrix.
    type Error: Error;

    /// The transition matrix of one element, and the state at its end.
    ///
    /// # Errors
    /// As [`transition_matrix`](super::transition_matrix).
    fn step(
        model: &M,
        element: Element,
        state: &Self::State,
        t: f64,
        h: f64,
    ) -> Result<(DMatrix<f64>, Self::State), Self::Error>;

    /// An orthonormal basis of the variations that the constraints allow at a state.
    ///
    /// # Errors
    /// As [`on_constraints`](super::on_constraints).
    fn basis(model: &M, t: f64, state: &Self::State) -> Result<DMatrix<f64>, Self::Error>;
}

impl<M: Model<N>, const N: usize> Transitions<M, N> for FixedLength {
    type State = State<N>;
    type Error = TransitionError;

    fn step(
        model: &M,
        element: Element,
        state: &State<N>,
        t: f64,
        h: f64,
    ) -> Result<(DMatrix<f64>, State<N>), TransitionError> {
        let mut entries = vec![0.0; 4 * N * N];
        let end = transition::of_step(model, element, state, t, h, &mut entries)?;
        Ok((DMatrix::from_row_slice(2 * N, 2 * N, &entries), end))
    }

    fn basis(model: &M, t: f64, state: &State<N>) -> Result<DMatrix<f64>, TransitionError> {
        Ok(tangent_basis(model, t, state)?)
    }
}

#[cfg(feature = "sparse")]
impl<M: family::Model> Transitions<M, 0> for RunTimeLength {
    type State = FamilyState;
    type Error = family::OperatorError;

    fn step(
        model: &M,
        element: Element,
        state: &FamilyState,
        t: f64,
        h: f64,
    ) -> Result<(DMatrix<f64>, FamilyState), family::OperatorError> {
        let step = family::TransitionOperator::of_step(model, element, state, t, h)?;
        Ok((step.matrix(), step.end().clone()))
    }

    fn basis(
        model: &M,
        t: f64,
        state: &FamilyState,
    ) -> Result<DMatrix<f64>, family::OperatorError> {
        Ok(basis_of(model, t, state)?)
    }
}

/// The transition matrix of one element of a model of run-time length, as an operator whose memory and time are linear
/// in the length of the model: the derivative of the step map (p, q) ↦ (p, q) at `state`.
///
/// ```text
/// (δp₁, δq₁) = A (δp₀, δq₀)                                                                             (theory.md (T-30))
/// ```
///
/// A Lagrangian may have any kinetic energy and constraints (theory.md (T-160)); a Hamiltonian must have ½ Σ p²/m.
///
/// # Shapes
/// 2n numbers, ordered (p, q).
/// # Errors
/// [`family::OperatorError::Family`] if the model, the element or the state is invalid or not supported,
/// [`Step`](family::OperatorError::Step) if the step cannot be solved or its tangent is singular,
/// [`Cut`](family::OperatorError::Cut) if the step is so long that it had to be cut.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(q[n]), lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2) - q[0]^2/2 - q[n-1]^2/2)]
/// struct Chain { n: usize }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let chain = Chain { n: 300 };
/// let rest = chain.state(vec![0.0; 300], vec![0.0; 300]);
/// // Frequencies to 2: at h = 1.65 the fastest modes are between √10/h and √12/h, where this element is unstable.
/// let step = stability::transition(&chain, Primal::<3>, &rest, 0.0, 1.65)?;
/// let found = stability::dominant(&step, stability::Iteration::default())?;
/// assert!(found.radius() > 1.01 && found.residual < 1e-10);
/// # Ok(())
/// # }
/// ```
#[cfg(feature = "sparse")]
pub fn transition<M: family::Model>(
    model: &M,
    element: impl Into<Element>,
    state: &FamilyState,
    t: f64,
    h: f64,
) -> Result<family::TransitionOperator, family::OperatorError> {
    family::TransitionOperator::of_step(model, element.into(), state, t, h)
}

/// The eigenvalue of largest modulus of a step, by [`dominant_of`]; its modulus is the spectral radius.
///
/// The momenta are first scaled by one number, determined from two products, to the size of the coordinates; the
/// residual is that of the scaled problem.
///
/// # Not guaranteed
/// As for [`dominant_of`]. About a stable equilibrium, all eigenvalues of a symplectic step have modulus one: the
/// result is then an error that holds the best value, or one of those eigenvalues; the residual says how good it is.
/// # Errors
/// As from [`dominant_of`].
#[cfg(feature = "sparse")]
pub fn dominant(
    transition: &family::TransitionOperator,
    control: Iteration,
) -> Result<Dominant, DominantError> {
    let (size, n) = (transition.size(), transition.size() / 2);
    let mut input = vec![0.0; size];
    let scale = momentum_scale(transition);
    let apply = |x: &[f64], y: &mut [f64]| {
        for a in 0..n {
            (input[a], input[n + a]) = (scale * x[a], x[n + a]);
        }
        if transition.apply(&input, y).is_err() {
            y.fill(f64::NAN);
        }
        for p in &mut y[..n] {
            *p /= scale;
        }
    };
    let mut found = dominant_of(size, apply, control);
    if let Ok(best) | Err(DominantError::NotConverged { best, .. }) = &mut found {
        best.products += 2;
    }
    found
}

/// The ratio of the scales of momenta and coordinates as a power of two: √(|∂p/∂q| / |∂q/∂p|), estimated with one
/// vector each.
#[cfg(feature = "sparse")]
fn momentum_scale(transition: &family::TransitionOperator) -> f64 {
    let (size, n) = (transition.size(), transition.size() / 2);
    let mut end = vec![0.0; size];
    let mut part = |from_p: bool| -> f64 {
        // Neighbours alternate irregularly in sign and size, so that stiff directions contribute.
        let value = |a: usize| (1.7 * (a * a) as f64).sin();
        let direction: Vec<f64> = (0..size)
            .map(|k| if (k < n) == from_p { value(k % n) } else { 0.0 })
            .collect();
        if transition.apply(&direction, &mut end).is_err() {
            return 0.0;
        }
        let other = if from_p { &end[n..] } else { &end[..n] };
        other.iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    let ratio = part(false) / part(true);
    if ratio.is_finite() && ratio > 0.0 {
        (0.5 * ratio.log2()).round().exp2()
    } else {
        1.0
    }
}
