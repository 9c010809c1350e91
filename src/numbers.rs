//! Comparisons of numbers that do not lose a NaN, norms of any size, and numbers of any size in messages.

use std::fmt;

/// A number in a message, in scientific notation if it is very small or large.
pub(crate) struct Short(pub(crate) f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number) = self;
        let size = number.abs();
        if size == 0.0 || (1e-5..1e16).contains(&size) || !size.is_finite() {
            number.fmt(f)
        } else {
            write!(f, "{number:e}")
        }
    }
}

/// The message about a number that [cannot be](is_tolerance) the tolerance of an iteration.
pub(crate) struct WrongTolerance(pub(crate) f64);

impl fmt::Display for WrongTolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the tolerance is {}, but it must be at least 0 and less than 1: leave `.tolerance(…)` out, or give a small number",
            Short(self.0)
        )
    }
}

/// A number in a table with a number of decimals, or in scientific notation if these would show little.
pub(crate) fn digits(number: f64, decimals: usize) -> String {
    if number == 0.0 || (1e-2..1e9).contains(&number.abs()) {
        format!("{number:.decimals$}")
    } else {
        format!("{number:.decimals$e}")
    }
}

/// Whether a number can be the tolerance of an iteration, relative to its result: one, and with it infinity, would
/// accept any guess, and what is not a number, or below zero, would accept nothing.
pub(crate) fn is_tolerance(number: f64) -> bool {
    (0.0..1.0).contains(&number)
}

/// The larger of two numbers; NaN if one is NaN, which `f64::max` would ignore: `errors.fold(0.0, larger)`.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}

/// The smaller of two numbers; NaN if one is NaN.
pub(crate) fn smaller(a: f64, b: f64) -> f64 {
    if a.is_nan() || a <= b { a } else { b }
}

/// Raises a maximum to a new value; NaN is kept.
pub(crate) fn raise(so_far: &mut f64, value: f64) {
    *so_far = larger(*so_far, value);
}

/// The largest magnitude.
pub(crate) fn largest(numbers: &[f64]) -> f64 {
    numbers.iter().fold(0.0, |most, x| larger(most, x.abs()))
}

/// The Euclidean norm of numbers of any size; NaN if one is NaN.
pub(crate) fn norm(numbers: &[f64]) -> f64 {
    let squares: f64 = numbers.iter().map(|x| x * x).sum();
    // A square that underflows changes no digit of such a sum.
    if (1e-250..1e250).contains(&squares) {
        return squares.sqrt();
    }
    let largest = largest(numbers);
    if !(largest > 0.0 && largest.is_finite()) {
        return largest;
    }
    let sum: f64 = numbers.iter().map(|x| (x / largest).powi(2)).sum();
    largest * sum.sqrt()
}

/// The distance of two points.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    norm(&differences)
}

/// A row of a table that is stored row by row; `None` beyond the last.
pub(crate) fn row_of(table: &[f64], columns: usize, row: usize) -> Option<&[f64]> {
    let start = row.checked_mul(columns)?;
    table.get(start..start.checked_add(columns)?)
}

#[cfg(test)]
mod tests {
    use super::{Short, distance, is_tolerance, larger, norm, row_of, smaller};

    #[test]
    fn numbers_have_no_rows_of_zeros() {
        let shown = |number: f64| Short(number).to_string();
        assert_eq!(
            [0.1, 0.0, -3.0, 1e15].map(shown),
            ["0.1", "0", "-3", "1000000000000000"]
        );
        assert_eq!([1e-6, -2.5e300].map(shown), ["1e-6", "-2.5e300"]);
        assert_eq!([f64::NAN, f64::INFINITY].map(shown), ["NaN", "inf"]);
    }

    #[test]
    fn tolerances_are_parts_of_one() {
        for right in [0.0, -0.0, 5e-324, 1e-13, 0.5] {
            assert!(is_tolerance(right), "{right:e}");
        }
        for wrong in [f64::NAN, f64::INFINITY, -f64::INFINITY, -1e-13, 1.0, 1e308] {
            assert!(!is_tolerance(wrong), "{wrong:e}");
        }
    }

    #[test]
    fn norms_have_all_digits_whatever_the_size() {
        for size in [1e-300, 1e-160, 1e-125, 1.0, 1e125, 1e160, 1e300] {
            let length = norm(&[3.0 * size, 0.0, -4.0 * size]);
            // Rounding errors of three products, two sums and a root.
            assert!(
                (length / size - 5.0).abs() <= 8.0 * f64::EPSILON * 5.0,
                "{size:e}: {length:e}"
            );
            let apart = distance(&[size, 0.0], &[-2.0 * size, 4.0 * size]);
            assert!(
                (apart / size - 5.0).abs() <= 8.0 * f64::EPSILON * 5.0,
                "{size:e}: {apart:e}"
            );
        }
        assert_eq!((norm(&[]), norm(&[0.0, -0.0])), (0.0, 0.0));
        assert_eq!(norm(&[f64::NEG_INFINITY, 1.0]), f64::INFINITY);
        assert!(
            norm(&[1e300, f64::NAN, 1.0]).is_nan() && norm(&[f64::NAN, f64::INFINITY]).is_nan()
        );
    }

    #[test]
    fn there_is_no_row_beyond_the_last() {
        let table = [1.0, 2.0, 3.0, 4.0];
        assert_eq!(row_of(&table, 2, 1), Some(&table[2..]));
        for beyond in [2, usize::MAX / 2, usize::MAX / 2 + 1, usize::MAX] {
            assert_eq!(row_of(&table, 2, beyond), None, "{beyond}");
        }
    }

    #[test]
    fn a_nan_stays_whatever_follows() {
        assert!([1.0, f64::NAN, 2.0].into_iter().fold(0.0, larger).is_nan());
        assert_eq!([1.0, 3.0, 2.0].into_iter().fold(0.0, larger), 3.0);
        assert!([1.0, f64::NAN, 2.0].into_iter().fold(0.0, smaller).is_nan());
        assert_eq!([1.0, -3.0, 2.0].into_iter().fold(0.0, smaller), -3.0);
    }
}
