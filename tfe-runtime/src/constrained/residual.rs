//! The relative violation of constraints.

use super::rows::{Rows, norm};

/// A velocity that moves less than this fraction of the positions in one step counts as rest.
pub(crate) const REST: f64 = 1e-5;

/// The relative violation, by positions and by velocities, of a constraint that has been evaluated: the distance |φ| /
/// |A| relative to the positions, and |A v + a| / |A| relative to the velocities that matter in a step of length h.
pub(crate) fn relative_residual<const N: usize>(
    rows: &Rows<'_, N>,
    c: usize,
    q: &[f64; N],
    v: &[f64; N],
    h: f64,
) -> (f64, f64) {
    let length = norm(&rows.rows[c]);
    let length = if length > 0.0 { length } else { 1.0 };
    let extent = norm(q);
    let speed = norm(v)
        .max(rows.drift[c].abs() / length)
        .max(REST * extent / h.abs());
    (
        over(rows.values[c] / length, extent),
        over(rows.psi(c, v) / length, speed),
    )
}

/// |value| / scale; 0/0 is zero, and NaN stays NaN.
pub(super) fn over(value: f64, scale: f64) -> f64 {
    if value == 0.0 {
        0.0
    } else {
        value.abs() / scale
    }
}
