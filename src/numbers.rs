//! Comparisons of numbers in which no NaN is lost.

/// The larger one; NaN if one is, which `f64::max` would drop: `errors.fold(0.0, larger)`.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}

/// Keeps the larger one of what there is and a new value; NaN once one was.
pub(crate) fn raise(so_far: &mut f64, value: f64) {
    *so_far = larger(*so_far, value);
}

/// The largest magnitude.
#[cfg(feature = "fit")]
pub(crate) fn largest(numbers: &[f64]) -> f64 {
    numbers.iter().fold(0.0, |most, x| larger(most, x.abs()))
}

/// The root of the sum of squares, of numbers of any size.
#[cfg(feature = "fit")]
pub(crate) fn norm(numbers: &[f64]) -> f64 {
    let largest = largest(numbers);
    if largest == 0.0 {
        return 0.0;
    }
    let sum: f64 = numbers.iter().map(|x| (x / largest).powi(2)).sum();
    largest * sum.sqrt()
}

#[cfg(test)]
mod tests {
    use super::larger;

    #[test]
    fn a_nan_stays_whatever_follows() {
        assert!([1.0, f64::NAN, 2.0].into_iter().fold(0.0, larger).is_nan());
        assert_eq!([1.0, 3.0, 2.0].into_iter().fold(0.0, larger), 3.0);
    }
}
