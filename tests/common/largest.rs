//! The largest of several numbers, in which no NaN is lost.

/// The larger number, or NaN if one of them is, which `f64::max` would ignore. Use: `errors.fold(0.0, larger)`.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}
