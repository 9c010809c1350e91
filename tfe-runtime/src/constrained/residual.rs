//! The relative violation of constraints.

use super::rows::{Rows, norm};
use crate::control::START_TOLERANCE;

/// The number of roundings of the time by which steps may begin behind a jump.
const BEHIND: f64 = 256.0;

/// A velocity that moves less than this fraction of the positions in one step counts as rest.
pub(crate) const REST: f64 = 1e-5;

/// The relative violation, by positions and by velocities, of a constraint that has been evaluated: the distance |φ| /
/// |A| relative to the positions and how far they move in a step of length h, and |A v + a| / |A| relative to the
/// velocities that matter in such a step.
pub(crate) fn relative_residual<const N: usize>(
    rows: &Rows<'_, N>,
    c: usize,
    q: &[f64; N],
    v: &[f64; N],
    h: f64,
) -> (f64, f64) {
    let length = norm(&rows.rows[c]);
    let length = if length > 0.0 { length } else { 1.0 };
    let extent = farthest(norm(q), norm(v), h);
    let speed = norm(v)
        .max(rows.drift[c].abs() / length)
        .max(REST * extent / h.abs());
    (
        over(rows.values[c] / length, extent),
        over(rows.psi(c, v) / length, speed),
    )
}

/// How far from the positions that constraints allow a step from t to t + h may begin where the motion has led, for positions
/// that reach this far and this speed. Farther away the constraints must have jumped.
pub(crate) fn largest_gap(extent: f64, speed: f64, (t, h): (f64, f64)) -> f64 {
    let rounding = BEHIND * f64::EPSILON * t.abs() * speed;
    START_TOLERANCE * farthest(extent, speed, h) + rounding
}

/// How far positions reach, or move in a step of length h: a motion may lead them through zero.
pub(crate) fn farthest(extent: f64, speed: f64, h: f64) -> f64 {
    extent.max(h.abs() * speed)
}

/// |value| / scale; 0/0 is zero, and NaN stays NaN.
pub(super) fn over(value: f64, scale: f64) -> f64 {
    if value == 0.0 {
        0.0
    } else {
        value.abs() / scale
    }
}
