//! The check of constraints relative to the size of their own terms, in steps.

use super::constrains::Constrains;
use super::rows::Rows;

/// The first holonomic constraint that a state violates by more than a start may, relative to the size of its own terms
/// (T-165): whether by positions, and the relative violation. `None` without the standard library, on which enclosures
/// of these terms depend.
///
/// `left` is the error that iterations may leave, relative to all positions and velocities. The rows have been
/// evaluated as declared, if they are given.
pub(crate) fn violated<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    (q, v): (&[f64; N], &[f64; N]),
    (h, left): (f64, f64),
    rows: Option<&Rows<'_, N>>,
) -> Option<(usize, bool, f64)> {
    #[cfg(feature = "std")]
    {
        let scales = super::start::Scales {
            h,
            extent: super::rows::norm(q),
            // Iterations accept increments of this size as rounding errors.
            tolerance: left.max(crate::control::POSITION_ROUND_OFF),
        };
        super::start::violated(model, t, (q, v), scales, rows)
    }
    #[cfg(not(feature = "std"))]
    {
        let _ = (model, t, q, v, h, left, rows);
        None
    }
}
