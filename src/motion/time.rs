//! Which times are one.

/// Whether two times are one but for rounding: an element between them would be rounding. No time is the same as an infinite one.
pub(crate) fn is_same_time(a: f64, b: f64) -> bool {
    let size = a.abs().max(b.abs());
    size < f64::INFINITY && (a - b).abs() <= 8.0 * f64::EPSILON * size
}
