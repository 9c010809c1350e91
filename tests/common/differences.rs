//! Numerical derivatives by central differences of eighth order, for tests in which no exact reference exists.

#![allow(dead_code)] // each test target uses its part

/// The derivatives of several numbers with respect to `x`, with a spacing at which rounding errors of 1e-15 in the
/// values lead to errors of about 1e-13.
pub fn difference<T: AsMut<[f64]>>(of: impl Fn(f64) -> T, x: f64) -> T {
    difference_over(4e-3 * x.abs().max(0.1), of, x)
}

/// The same with a given spacing.
pub fn difference_over<T: AsMut<[f64]>>(distance: f64, of: impl Fn(f64) -> T, x: f64) -> T {
    let pair = |k: f64, weight: f64| {
        let (mut high, mut low) = (of(x + k * distance), of(x - k * distance));
        for (high, low) in high.as_mut().iter_mut().zip(low.as_mut()) {
            *high = weight * (*high - *low) / distance;
        }
        high
    };
    let mut sum = pair(1.0, 4.0 / 5.0);
    for (k, weight) in [(2.0, -1.0 / 5.0), (3.0, 4.0 / 105.0), (4.0, -1.0 / 280.0)] {
        for (sum, term) in sum.as_mut().iter_mut().zip(pair(k, weight).as_mut()) {
            *sum += *term;
        }
    }
    sum
}
