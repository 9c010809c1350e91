//! The projection of a position onto holonomic constraints: what no model is part of.

use crate::numbers::norm;
use nalgebra::{DMatrix, DVector};
use tfe_runtime::constrained::{Residual, START_TOLERANCE};
use tfe_runtime::{Constraint, StepError};

/// The indices of the holonomic constraints.
pub(super) fn holonomic(declared: &[Constraint]) -> Vec<usize> {
    let all = 0..declared.len();
    all.filter(|c| declared[*c].kind.is_holonomic()).collect()
}

/// One step of the projection: to the tangent planes of the holonomic constraints, given by their indices, and along
/// these towards the given position. `rows` and `values` are those of all constraints at q, row after row.
///
/// Rows are normalised, so that the rank does not depend on the units of constraints, nor on those of coordinates where
/// these are very different.
pub(super) fn step_to_planes(
    holonomic: &[usize],
    (rows, values): (&mut [f64], &[f64]),
    units: &[f64],
    (given, q): (&[f64], &[f64]),
) -> Option<DVector<f64>> {
    let n = q.len();
    for row in rows.chunks_exact_mut(n) {
        for (entry, unit) in row.iter_mut().zip(units) {
            *entry *= unit;
        }
    }
    let row = |c: usize| &rows[c * n..(c + 1) * n];
    let scale = |c: usize| {
        let length = norm(row(c));
        if length > 0.0 { length } else { 1.0 }
    };
    let a = DMatrix::from_fn(holonomic.len(), n, |k, column| {
        row(holonomic[k])[column] / scale(holonomic[k])
    });
    let phi = DVector::from_fn(holonomic.len(), |k, _| {
        values[holonomic[k]] / scale(holonomic[k])
    });
    let back = DVector::from_fn(n, |a, _| (given[a] - q[a]) / units[a]);
    let inverse = a.clone().pseudo_inverse(1e-10).ok()?;
    let tangent = &back - &inverse * (&a * &back);
    let step = tangent - inverse * phi;
    Some(DVector::from_fn(n, |a, _| step[a] * units[a]))
}

/// The progress of a projection.
pub(super) struct Projection {
    /// The size of the last step.
    last: f64,
    pub(super) iterations: u32,
}

/// Where a step of a projection has led.
pub(super) enum Led {
    /// To the constraints, as close as rounding errors allow.
    Reached,
    /// By a rounding error: to the constraints if they hold. A violation that is negligible relative to large
    /// coordinates may be large for small ones.
    Settled,
    Closer,
}

impl Projection {
    pub(super) const BEGUN: Self = Self {
        last: f64::INFINITY,
        iterations: 0,
    };

    /// Moves a position by a step.
    ///
    /// # Errors
    /// A step that is not finite.
    pub(super) fn pass(&mut self, step: &DVector<f64>, q: &mut [f64]) -> Result<Led, StepError> {
        self.iterations += 1;
        for (q, step) in q.iter_mut().zip(step.iter()) {
            *q += step;
        }
        let (size, scale) = (norm(step.as_slice()), norm(q));
        if !size.is_finite() {
            return Err(StepError::NonFinite);
        }
        let is_stuck = size >= self.last && size <= 1e-12 * scale;
        self.last = size;
        Ok(if is_stuck {
            Led::Reached
        } else if size <= 2.0 * f64::EPSILON * scale {
            Led::Settled
        } else {
            Led::Closer
        })
    }
}

/// Whether a position satisfies the holonomic constraints within the tolerance for a start.
pub(super) fn hold(residuals: &[Residual]) -> bool {
    let mut positions = residuals.iter().map(|one| one.relative_position);
    positions.all(|position| position <= START_TOLERANCE)
}

/// Whether a state satisfies all constraints within the tolerance for a start.
pub(super) fn all_hold(residuals: &[Residual]) -> bool {
    let mut relative = residuals.iter().map(Residual::relative);
    relative.all(|one| one <= START_TOLERANCE)
}
