//! The undamped oscillator, L = ½ q̇² − ½ q²; since its frequency is one, the step h equals ρ = ωh.

use nalgebra::DMatrix;
use tfe::prelude::*;
use tfe::stability::{IntervalError, TransitionError, UnstableInterval};

#[dynamics(coordinates(q), lagrangian = dot(q)^2/2 - q^2/2)]
struct Oscillator {}

/// The transition matrix of one element, in the order (p, q).
pub fn transition(element: Element, rho: f64) -> Result<DMatrix<f64>, TransitionError> {
    let rest = Oscillator {}.state([0.0], [0.0]);
    stability::transition_matrix(&Oscillator {}, element, &rest, 0.0, rho)
}

/// The intervals of ρ up to `end` in which the amplitude grows.
pub fn unstable(
    element: Element,
    end: f64,
) -> Result<Vec<UnstableInterval>, IntervalError<TransitionError>> {
    let rest = Oscillator {}.state([0.0], [0.0]);
    stability::unstable_intervals(&Oscillator {}, element, &rest, 0.0..end)
}
