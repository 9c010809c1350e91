//! The undamped oscillator, L = ½ q̇² − ½ q²: with unit frequency the step h is ρ = ωh.

use nalgebra::DMatrix;
use tfe::prelude::*;
use tfe::stability::{IntervalError, TransitionError, UnstableInterval};

#[dynamics(coordinates(q), lagrangian = dot(q)^2/2 - q^2/2)]
struct Oscillator {}

/// The transition matrix of one element in the order (p, q).
pub fn transition(element: Element, rho: f64) -> Result<DMatrix<f64>, TransitionError> {
    let rest = Oscillator {}.state([0.0], [0.0]);
    stability::transition_matrix(&Oscillator {}, element, &rest, 0.0, rho)
}

/// Where the amplitude grows, up to `end`.
pub fn unstable(
    element: Element,
    end: f64,
) -> Result<Vec<UnstableInterval>, IntervalError<TransitionError>> {
    let rest = Oscillator {}.state([0.0], [0.0]);
    stability::unstable_intervals(&Oscillator {}, element, &rest, 0.0..end)
}
