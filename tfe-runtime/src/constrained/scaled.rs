//! Factors of matrices some of whose rows have another unit than the rest.

use crate::lu::{Singular, factor};

/// As [`factor`], with pivots chosen as if some rows were multiplied by `scale`, a power of two. The factors are those of
/// the matrix as it is, because products with a power of two are exact.
///
/// # Errors
/// [`Singular`], as of [`factor`]; the matrix is then lost.
pub(crate) fn factor_scaled(
    size: usize,
    matrix: &mut [f64],
    pivots: &mut [usize],
    (scale, is_scaled): (f64, &dyn Fn(usize) -> bool),
) -> Result<(), Singular> {
    if scale == 1.0 {
        return factor(size, matrix, pivots);
    }
    let multiply = |row: &mut [f64], factor: f64| row.iter_mut().for_each(|entry| *entry *= factor);
    for (row, entries) in matrix.chunks_exact_mut(size).take(size).enumerate() {
        if is_scaled(row) {
            multiply(entries, scale);
        }
    }
    factor(size, matrix, pivots)?;
    // S A = L U with the diagonal S, so that A = (S⁻¹ L S) (S⁻¹ U).
    let was_scaled = |place: usize| is_scaled(origin(place, &pivots[..size]));
    for (place, entries) in matrix.chunks_exact_mut(size).take(size).enumerate() {
        if was_scaled(place) {
            multiply(entries, 1.0 / scale);
        }
    }
    for column in (0..size).filter(|column| was_scaled(*column)) {
        for row in column + 1..size {
            matrix[row * size + column] *= scale;
        }
    }
    Ok(())
}

/// The row of the matrix that has come to a place by the exchanges of a factorisation.
fn origin(place: usize, pivots: &[usize]) -> usize {
    let exchanges = pivots.iter().enumerate().rev();
    exchanges.fold(place, |at, (row, &other)| match at {
        at if at == row => other,
        at if at == other => row,
        at => at,
    })
}

/// Ratios of masses to squares of slopes beyond which rows of constraints are scaled: within them rounding errors of one
/// kind of rows leave half of the digits of the other.
const ORDINARY: core::ops::Range<f64> = 1.0 / ((1 << 20) as f64)..(1 << 20) as f64;

/// What [`factor_scaled`] multiplies rows A of constraints by that stand beside a mass matrix M,
///
/// ```text
/// [ M  Aᵀ ]
/// [ A  0  ] ,
/// ```
///
/// at the given place on the diagonal of a matrix: the ratio of masses to the squares of slopes, which depends on the units
/// of masses and of constraints, but not on those of coordinates. One where that is neither very small nor very large for
/// all coordinates.
pub(crate) fn scale_of_constraints(
    size: usize,
    matrix: &[f64],
    coordinates: core::ops::Range<usize>,
    constraints: core::ops::Range<usize>,
) -> f64 {
    let largest = |rows: core::ops::Range<usize>, column: usize| {
        let entries = rows.map(|row| matrix[row * size + column].abs());
        entries.fold(0.0_f64, f64::max)
    };
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for column in coordinates.clone() {
        let mass = largest(coordinates.clone(), column);
        let slope = largest(constraints.clone(), column);
        let ratio = mass / slope / slope;
        if ratio > 0.0 && ratio.is_finite() {
            (least, most) = (least.min(ratio), most.max(ratio));
        }
    }
    let scale = if 0.0 < most && most < ORDINARY.start {
        most
    } else if ORDINARY.end < least && least < f64::INFINITY {
        least
    } else {
        return 1.0;
    };
    // The power of two below it; its inverse is exact as well.
    let power = f64::from_bits(scale.to_bits() & f64::INFINITY.to_bits());
    if (f64::MIN_POSITIVE..1.0 / f64::MIN_POSITIVE).contains(&power) {
        power
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lu::solve;

    /// Three coordinates, two of which have one mass together, and two constraints.
    fn bordered(mass: f64) -> [f64; 25] {
        let (one, both) = (0.3 * mass, 0.7 * mass);
        [
            [one, 0.0, 0.0, 0.9, 0.2],
            [0.0, both, both, -0.4, 1.1],
            [0.0, both, both, 0.3, 0.8],
            [0.9, -0.4, 0.3, 0.0, 0.0],
            [0.2, 1.1, 0.8, 0.0, 0.0],
        ]
        .as_flattened()
        .try_into()
        .expect("25 numbers")
    }

    /// The solution is x = (1, −2, 3) with multipliers of the size of the masses; forces are sums that may cancel.
    #[test]
    fn masses_of_any_unit_are_solved_for() {
        for mass in [1e-30, 1e-20, 1e-12, 1.0, 1e12, 1e20, 1e30] {
            let matrix = bordered(mass);
            let solution = [1.0, -2.0, 3.0, 0.5 * mass, -0.25 * mass];
            let mut vector: [f64; 5] = core::array::from_fn(|row| {
                (0..5)
                    .map(|column| matrix[5 * row + column] * solution[column])
                    .sum()
            });
            let (mut factors, mut pivots) = (matrix, [0; 5]);
            let scale = scale_of_constraints(5, &matrix, 0..3, 3..5);
            let is_scaled = |row: usize| row >= 3;
            factor_scaled(5, &mut factors, &mut pivots, (scale, &is_scaled)).expect("regular");
            solve(5, &factors, &pivots, &mut vector);
            for (found, expected) in vector.iter().zip(&solution) {
                let off = (found - expected) / expected;
                assert!(off.abs() < 256.0 * f64::EPSILON, "{mass:e}: {off:e}");
            }
        }
    }

    #[test]
    fn ordinary_masses_are_not_scaled() {
        for mass in [1e-4, 1.0, 1e4] {
            assert_eq!(scale_of_constraints(5, &bordered(mass), 0..3, 3..5), 1.0);
        }
        let free = [1e-20, 0.0, 0.0, 1.0];
        assert_eq!(scale_of_constraints(2, &free, 0..1, 1..2), 1.0);
    }
}
