//! Dense LU factorisation with partial pivoting, on memory provided by the caller.
//!
//! Matrices are flat, row by row. Sizes are small (rates times coordinates). Small matrices are treated by plain loops,
//! larger ones in the widest registers of the processor, with the same roundings.

mod substitution;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
mod wide;

use substitution::LARGE;

/// Below this number of rows, wide registers are not worth using.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
const WIDE: usize = 24;

/// A pivot is zero or not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular {
    /// The column at which elimination stopped.
    pub column: usize,
}

/// Factors a `size` × `size` matrix in place; `pivots[k]` is the row that was exchanged with row k.
///
/// # Errors
/// [`Singular`] if no row has a finite, non-zero pivot.
#[cfg_attr(feature = "alloc", inline)]
#[cfg_attr(not(feature = "alloc"), inline(never))] // small programs
pub fn factor(size: usize, matrix: &mut [f64], pivots: &mut [usize]) -> Result<(), Singular> {
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    if size >= WIDE
        && let Some(isa) = pulp::x86::V3::try_new()
    {
        // Entries of the slice beyond the matrix are left unchanged.
        let matrix = &mut matrix[..size * size];
        return wide::factor(isa, size, matrix, pivots).map_err(|column| Singular { column });
    }
    factor_plainly(size, matrix, pivots)
}

#[inline(always)]
fn factor_plainly(size: usize, matrix: &mut [f64], pivots: &mut [usize]) -> Result<(), Singular> {
    for (column, exchanged) in pivots[..size].iter_mut().enumerate() {
        let (upper, lower) = matrix[..size * size].split_at_mut((column + 1) * size);
        let own = &mut upper[column * size..];
        let (mut pivot, mut largest) = (column, own[column].abs());
        for (row, candidate) in (column + 1..).zip(lower.chunks_exact(size)) {
            if candidate[column].abs() > largest {
                (pivot, largest) = (row, candidate[column].abs());
            }
        }
        *exchanged = pivot;
        if pivot != column {
            own.swap_with_slice(&mut lower[(pivot - column - 1) * size..][..size]);
        }
        let (head, pivot_row) = own.split_at(column + 1);
        let value = head[column];
        if value == 0.0 || !value.is_finite() {
            return Err(Singular { column });
        }
        for row in lower.chunks_exact_mut(size) {
            let (head, tail) = row.split_at_mut(column + 1);
            let factor = head[column] / value;
            head[column] = factor;
            // Zero blocks are common in tangents of several coordinates.
            if factor != 0.0 {
                for (entry, pivot) in tail.iter_mut().zip(pivot_row) {
                    *entry -= factor * pivot;
                }
            }
        }
    }
    Ok(())
}

/// Solves A x = b in place with the factors of A.
#[inline]
pub fn solve(size: usize, factors: &[f64], pivots: &[usize], vector: &mut [f64]) {
    for k in 0..size {
        vector.swap(k, pivots[k]);
    }
    // Programs without an allocator are to be small: one code for all sizes.
    if size >= LARGE || cfg!(not(feature = "alloc")) {
        return solve_large(size, factors, vector);
    }
    let rows = factors[..size * size].chunks_exact(size.max(1)).enumerate();
    let vector = &mut vector[..size];
    for (k, row) in rows.clone() {
        let (done, own) = vector.split_at_mut(k);
        for (factor, known) in row.iter().zip(done) {
            own[0] -= factor * *known;
        }
    }
    for (k, row) in rows.rev() {
        let (own, done) = vector.split_at_mut(k + 1);
        let mut sum = own[k];
        for (factor, known) in row[k + 1..].iter().zip(&*done) {
            sum -= factor * known;
        }
        own[k] = sum / row[k];
    }
}

#[inline(never)]
fn solve_large(size: usize, factors: &[f64], vector: &mut [f64]) {
    let vector = &mut vector[..size];
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    if let Some(isa) = pulp::x86::V3::try_new() {
        return wide::solve(isa, size, factors, vector);
    }
    substitution::solve(size, factors, vector);
}

/// Solves Aᵀ x = b in place with the factors of A.
pub(crate) fn solve_transposed(size: usize, factors: &[f64], pivots: &[usize], vector: &mut [f64]) {
    transposed(size, factors, vector);
    for k in (0..size).rev() {
        vector.swap(k, pivots[k]);
    }
}

fn transposed(size: usize, factors: &[f64], vector: &mut [f64]) {
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    if let Some(isa) = pulp::x86::V3::try_new() {
        return wide::solve_transposed(isa, size, factors, vector);
    }
    substitution::solve_transposed(size, factors, vector);
}

/// Solves A X = B in place with the factors of A: `columns` right-hand sides at once, B row by row.
pub(crate) fn solve_columns(factors: &[f64], pivots: &[usize], columns: usize, sides: &mut [f64]) {
    let size = pivots.len();
    for (k, &pivot) in pivots.iter().enumerate() {
        if pivot != k {
            for column in 0..columns {
                sides.swap(k * columns + column, pivot * columns + column);
            }
        }
    }
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    if size >= LARGE
        && let Some(isa) = pulp::x86::V3::try_new()
    {
        return wide::substitute(isa, size, factors, columns, sides);
    }
    substitution::solve_columns(size, factors, columns, sides);
}

/// Factors an N × N block; a matrix that is singular up to rounding is reported as singular.
#[inline]
pub(crate) fn factor_block<const N: usize>(
    matrix: &mut [f64],
    pivots: &mut [usize],
) -> Result<(), Singular> {
    // Each column has the unit of its coordinate: a pivot is small only relative to its column.
    let mut scales = [0.0_f64; N];
    for row in matrix.chunks_exact(N) {
        for (scale, entry) in scales.iter_mut().zip(row) {
            *scale = scale.max(entry.abs());
        }
    }
    factor(N, matrix, pivots)?;
    for (column, scale) in scales.iter().enumerate() {
        const ROUNDING: f64 = 8.0 * f64::EPSILON;
        let pivot = matrix[column * N + column].abs();
        if pivot.is_nan() || (pivot <= ROUNDING * scale && is_lost(N, matrix, column, ROUNDING)) {
            return Err(Singular { column });
        }
    }
    Ok(())
}

/// Whether a pivot has lost its digits by cancellation: whether it is at most the fraction `part` of the terms
/// subtracted from it, Σ |L_ck U_kc|. A comparison with its column alone would not do, because the rows of a mass
/// matrix have units as well, and a pivot that is small relative to its column may have all its digits. The units of
/// rows and columns scale both sides of this test equally.
#[cold]
#[inline(never)]
pub(crate) fn is_lost(size: usize, factors: &[f64], column: usize, part: f64) -> bool {
    let mut subtracted = 0.0;
    for k in 0..column {
        subtracted += (factors[column * size + k] * factors[k * size + column]).abs();
    }
    // A NaN counts as lost.
    !(factors[column * size + column].abs() > part * subtracted)
}

/// The LU factors of a mass matrix, or of another N × N block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Block<const N: usize> {
    factors: [[f64; N]; N],
    pivots: [usize; N],
}

impl<const N: usize> Block<N> {
    /// Factors a matrix; one that is singular up to rounding is reported as singular.
    #[inline]
    pub(crate) fn of(matrix: &[[f64; N]; N]) -> Result<Self, Singular> {
        let mut block = Self {
            factors: *matrix,
            pivots: [0; N],
        };
        factor_block::<N>(block.factors.as_flattened_mut(), &mut block.pivots)?;
        Ok(block)
    }

    #[inline]
    pub(crate) fn solve(&self, vector: &mut [f64]) {
        solve(N, self.factors.as_flattened(), &self.pivots, vector);
    }

    /// The inverse, for formulas that need all of its entries.
    #[inline]
    pub(crate) fn inverse(&self) -> [[f64; N]; N] {
        let mut inverse = [[0.0; N]; N];
        for column in 0..N {
            let mut unit = [0.0; N];
            unit[column] = 1.0;
            self.solve(&mut unit);
            for row in 0..N {
                inverse[row][column] = unit[row];
            }
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_needs_pivoting() {
        let matrix = [0.0, 2.0, 1.0, 1.0, -2.0, -3.0, -1.0, 1.0, 2.0];
        let solution = [1.0, -2.0, 3.0];
        let mut vector = [0.0; 3];
        for i in 0..3 {
            vector[i] = (0..3).map(|j| matrix[3 * i + j] * solution[j]).sum();
        }
        let (mut factors, mut pivots) = (matrix, [0; 3]);
        factor(3, &mut factors, &mut pivots).unwrap();
        solve(3, &factors, &pivots, &mut vector);
        for i in 0..3 {
            assert!((vector[i] - solution[i]).abs() < 16.0 * f64::EPSILON);
        }
    }

    #[test]
    fn singular_and_not_a_number_are_told() {
        let mut pivots = [0; 2];
        let singular = factor(2, &mut [1.0, 2.0, 2.0, 4.0], &mut pivots);
        assert_eq!(singular, Err(Singular { column: 1 }));
        let nan = factor(2, &mut [f64::NAN, 2.0, 2.0, 4.0], &mut pivots);
        assert!(nan.is_err());
    }

    #[test]
    fn a_block_sees_singularity_through_rounding() {
        // Rank one, with entries that are not exact.
        let third = 1.0 / 3.0;
        let matrix = [[third, 0.1 * third], [0.7 * third, 0.07 * third + 1e-18]];
        assert!(Block::of(&matrix).is_err());
        // Badly scaled, but regular.
        assert!(Block::of(&[[1e12, 1e-6], [1e12, 2e-6]]).is_ok());
    }

    /// A body of one with a pendulum of a half, so short that its angle moves next to nothing: the matrix is as regular
    /// as of a long one.
    #[test]
    fn coordinates_may_have_any_units() {
        let length = 1e-17;
        let (both, turned, square) = (1.5, 0.5 * length, 0.5 * length * length);
        for (matrix, side) in [
            // M times (1, 1/length)
            (
                [[both, turned], [turned, square]],
                [both + turned / length, turned + square / length],
            ),
            (
                [[square, turned], [turned, both]],
                [square / length + turned, turned / length + both],
            ),
        ] {
            let mut solution = side;
            let block = Block::of(&matrix).expect("regular");
            block.solve(&mut solution);
            solution.sort_unstable_by(f64::total_cmp);
            let [distance, angle] = solution;
            // The pivot is two thirds of what it is the rest of: some roundings.
            assert!((distance - 1.0).abs() < 16.0 * f64::EPSILON, "{distance}");
            assert!(
                (angle * length - 1.0).abs() < 16.0 * f64::EPSILON,
                "{angle}"
            );
        }
    }
}

#[cfg(all(test, feature = "simd", target_arch = "x86_64"))]
mod wide_tests {
    use super::*;
    use alloc::vec;
    use alloc::vec::Vec;

    /// Numbers in (−1, 1), the same every time.
    fn numbers(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    /// One row of factors after the other.
    fn substitute_plainly(factors: &[f64], size: usize, columns: usize, sides: &mut [f64]) {
        let subtract = |row: &mut [f64], factor: f64, other: &[f64]| {
            for (entry, other) in row.iter_mut().zip(other) {
                *entry -= factor * other;
            }
        };
        for (k, factors) in factors.chunks_exact(size).enumerate() {
            let (done, rest) = sides.split_at_mut(k * columns);
            for (factor, other) in factors.iter().zip(done.chunks_exact(columns)) {
                subtract(&mut rest[..columns], *factor, other);
            }
        }
        for (k, factors) in factors.chunks_exact(size).enumerate().rev() {
            let (rest, done) = sides.split_at_mut((k + 1) * columns);
            let row = &mut rest[k * columns..];
            for (factor, other) in factors[k + 1..].iter().zip(done.chunks_exact(columns)) {
                subtract(row, *factor, other);
            }
            let inverse = 1.0 / factors[k];
            for entry in row {
                *entry *= inverse;
            }
        }
    }

    /// Every bit as with one pivot after the other, in all sizes.
    #[test]
    fn the_same_bits_as_one_after_the_other() {
        let Some(isa) = pulp::x86::V3::try_new() else {
            return;
        };
        for size in 1..40 {
            let mut matrix = numbers(size * size, size as u64);
            // Zero blocks, and ties of pivots.
            for (at, entry) in matrix.iter_mut().enumerate() {
                if (at / 3 + at / size).is_multiple_of(4) {
                    *entry = 0.0;
                }
            }
            for row in 0..size {
                matrix[row * size + row] += 0.5;
            }
            let (mut one, mut pivots) = (matrix.clone(), vec![0; size]);
            let (mut other, mut exchanged) = (matrix, vec![0; size]);
            let plain = factor_plainly(size, &mut one, &mut pivots);
            let wide = wide::factor(isa, size, &mut other, &mut exchanged);
            assert_eq!(plain, wide.map_err(|column| Singular { column }));
            if plain.is_err() {
                continue;
            }
            assert_eq!((&one, &pivots), (&other, &exchanged), "{size}");
            for columns in [1, 2, 5, 24] {
                let sides = numbers(size * columns, 7);
                let (mut a, mut b) = (sides.clone(), sides);
                substitute_plainly(&one, size, columns, &mut a);
                wide::substitute(isa, size, &one, columns, &mut b);
                assert_eq!(a, b, "{size} {columns}");
            }
        }
    }

    /// Every bit of one right side as with plain numbers, and a solution.
    #[test]
    fn one_right_side_has_the_same_bits() {
        let Some(isa) = pulp::x86::V3::try_new() else {
            return;
        };
        for size in 1..40 {
            let mut matrix = numbers(size * size, 5 + size as u64);
            for row in 0..size {
                matrix[row * size + row] += 3.0;
            }
            let wanted = numbers(size, 11);
            let rows = matrix.chunks_exact(size);
            let product = |row: &[f64]| row.iter().zip(&wanted).map(|(a, x)| a * x).sum();
            let side: Vec<f64> = rows.map(product).collect();
            let mut by_transposed = vec![0.0; size];
            for (row, x) in matrix.chunks_exact(size).zip(&wanted) {
                for (sum, entry) in by_transposed.iter_mut().zip(row) {
                    *sum += entry * x;
                }
            }
            let mut pivots = vec![0; size];
            factor(size, &mut matrix, &mut pivots).expect("regular");
            let mut exchanged = side.clone();
            for (k, pivot) in pivots.iter().enumerate() {
                exchanged.swap(k, *pivot);
            }
            let mut found = side;
            solve(size, &matrix, &pivots, &mut found);
            if size >= LARGE {
                let mut wide = exchanged.clone();
                wide::solve(isa, size, &matrix, &mut wide);
                assert_eq!(wide, found, "{size}");
            }
            substitution::solve(size, &matrix, &mut exchanged);
            assert_eq!(exchanged, found, "{size}");
            solve_transposed(size, &matrix, &pivots, &mut by_transposed);
            for found in [&found, &by_transposed] {
                for (found, wanted) in found.iter().zip(&wanted) {
                    assert!((found - wanted).abs() < 1e-12, "{size}: {found} {wanted}");
                }
            }
        }
    }

    #[test]
    fn what_lies_behind_a_matrix_or_a_vector_stays() {
        for size in [3, WIDE, 30] {
            let mut matrix = numbers(size * size, 17);
            for row in 0..size {
                matrix[row * size + row] += 3.0;
            }
            let mut alone = matrix.clone();
            matrix.resize(size * size + size, 7.0);
            let (mut pivots, mut others) = (vec![0; size], vec![0; size]);
            factor(size, &mut matrix, &mut pivots).expect("regular");
            factor(size, &mut alone, &mut others).expect("regular");
            assert_eq!((&matrix[..size * size], &pivots), (&alone[..], &others));
            assert_eq!(matrix[size * size..], vec![7.0; size], "{size}");
            let mut side = numbers(size, 23);
            let mut longer = side.clone();
            longer.resize(size + 5, 7.0);
            solve(size, &matrix, &pivots, &mut longer);
            solve(size, &alone, &pivots, &mut side);
            assert_eq!(longer[..size], side, "{size}");
            assert_eq!(longer[size..], [7.0; 5], "{size}");
        }
    }

    #[test]
    fn singular_ones_are_told() {
        let Some(isa) = pulp::x86::V3::try_new() else {
            return;
        };
        let mut pivots = [0; 9];
        let mut matrix = numbers(81, 3);
        for row in 0..9 {
            matrix[row * 9 + 6] = 0.0;
        }
        let told = wide::factor(isa, 9, &mut matrix, &mut pivots);
        assert_eq!(told, Err(6));
        matrix[0] = f64::NAN;
        assert!(wide::factor(isa, 9, &mut matrix, &mut pivots).is_err());
    }
}
