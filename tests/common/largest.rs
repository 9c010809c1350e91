//! The largest of several numbers, in which no NaN is lost.

/// The larger one; NaN if one is, which `f64::max` would drop: `errors.fold(0.0, larger)`.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}
