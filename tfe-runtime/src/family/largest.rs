//! The largest of several numbers.

/// The largest magnitude; NaN if one is.
pub(super) fn largest(values: &[f64]) -> f64 {
    let larger = |a: f64, b: &f64| {
        if a.is_nan() || a >= b.abs() {
            a
        } else {
            b.abs()
        }
    };
    values.iter().fold(0.0, larger)
}
