//! Gaussian elimination in wide registers: four pivots at a time, each entry with the same roundings as for one pivot
//! after the other.

use super::substitution::{self, FOUR, subtract, subtract_four};
use pulp::x86::V3;
use pulp::{NullaryFnOnce, f64x4};

/// Solves L U x = b in place; the rows of b have already been exchanged.
pub(super) fn solve(isa: V3, size: usize, factors: &[f64], vector: &mut [f64]) {
    isa.vectorize(Solve {
        isa,
        size,
        factors,
        vector,
    });
}

struct Solve<'a> {
    isa: V3,
    size: usize,
    factors: &'a [f64],
    vector: &'a mut [f64],
}

impl NullaryFnOnce for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self {
            isa,
            size,
            factors,
            vector,
        } = self;
        let whole = size / FOUR * FOUR;
        for first in (0..whole).step_by(FOUR) {
            let (done, own) = vector.split_at_mut(first);
            subtract_products(isa, size, &factors[first * size..], 0, done, own);
            for k in 1..FOUR {
                for j in 0..k {
                    own[k] -= factors[(first + k) * size + first + j] * own[j];
                }
            }
        }
        for row in whole..size {
            for j in 0..row {
                vector[row] -= factors[row * size + j] * vector[j];
            }
        }
        for row in (whole..size).rev() {
            for j in row + 1..size {
                vector[row] -= factors[row * size + j] * vector[j];
            }
            vector[row] /= factors[row * size + row];
        }
        for first in (0..whole).step_by(FOUR).rev() {
            let end = first + FOUR;
            let (rest, done) = vector.split_at_mut(end);
            let own = &mut rest[first..];
            subtract_products(isa, size, &factors[first * size..], end, done, own);
            for k in (0..FOUR).rev() {
                let row = &factors[(first + k) * size + first..];
                for j in k + 1..FOUR {
                    own[k] -= row[j] * own[j];
                }
                own[k] /= row[k];
            }
        }
    }
}

/// Subtracts the products of four rows, from one column on, with a vector.
#[inline(always)]
fn subtract_products(
    isa: V3,
    size: usize,
    rows: &[f64],
    column: usize,
    vector: &[f64],
    own: &mut [f64],
) {
    let (chunks, rest) = vector.as_chunks::<FOUR>();
    let mut parts: [&[f64]; FOUR] = [&[]; FOUR];
    for k in 0..FOUR {
        parts[k] = &rows[k * size + column..k * size + column + vector.len()];
    }
    let mut sums = [isa.splat_f64x4(0.0); FOUR];
    let mut fours: [&[[f64; FOUR]]; FOUR] = [&[]; FOUR];
    for k in 0..FOUR {
        fours[k] = &parts[k].as_chunks().0[..chunks.len()];
    }
    for (at, four) in chunks.iter().enumerate() {
        let four: f64x4 = pulp::cast(*four);
        for k in 0..FOUR {
            let product = isa.mul_f64x4(pulp::cast(fours[k][at]), four);
            sums[k] = isa.add_f64x4(sums[k], product);
        }
    }
    for k in 0..FOUR {
        let mut sum = substitution::total(pulp::cast(sums[k]));
        for (factor, other) in parts[k][chunks.len() * FOUR..].iter().zip(rest) {
            sum += factor * other;
        }
        own[k] -= sum;
    }
}

/// Solves Uᵀ Lᵀ x = b in place.
pub(super) fn solve_transposed(isa: V3, size: usize, factors: &[f64], vector: &mut [f64]) {
    isa.vectorize(Transposed {
        size,
        factors,
        vector,
    });
}

struct Transposed<'a> {
    size: usize,
    factors: &'a [f64],
    vector: &'a mut [f64],
}

impl NullaryFnOnce for Transposed<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        substitution::solve_transposed(self.size, self.factors, self.vector);
    }
}

/// Factors a matrix in place; returns the column at which elimination stopped, if it did.
pub(super) fn factor(
    isa: V3,
    size: usize,
    matrix: &mut [f64],
    pivots: &mut [usize],
) -> Result<(), usize> {
    isa.vectorize(Factor {
        size,
        matrix,
        pivots,
    })
}

/// Forward and backward substitution with many right-hand sides, row by row; their rows have already been exchanged.
pub(super) fn substitute(isa: V3, size: usize, factors: &[f64], columns: usize, sides: &mut [f64]) {
    isa.vectorize(Substitute {
        size,
        factors,
        columns,
        sides,
    });
}

struct Factor<'a> {
    size: usize,
    matrix: &'a mut [f64],
    pivots: &'a mut [usize],
}

impl NullaryFnOnce for Factor<'_> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self {
            size,
            matrix,
            pivots,
        } = self;
        let mut first = 0;
        while first < size {
            let end = (first + FOUR).min(size);
            for column in first..end {
                pivots[column] = pivot(size, matrix, column)?;
                eliminate(size, matrix, column, end);
            }
            // First the rows of the panel, then all rows below it.
            let (panel, below) = matrix.split_at_mut(end * size);
            for row in first + 1..end {
                let (above, own) = panel.split_at_mut(row * size);
                for k in first..row {
                    let (factors, entries) = own.split_at_mut(end);
                    let other = &above[k * size + end..(k + 1) * size];
                    if factors[k] != 0.0 {
                        subtract(&mut entries[..size - end], factors[k], other);
                    }
                }
            }
            let pivot_row = |k: usize| &panel[(first + k) * size + end..(first + k + 1) * size];
            if end - first == FOUR {
                let rows = [pivot_row(0), pivot_row(1), pivot_row(2), pivot_row(3)];
                for row in below.chunks_exact_mut(size) {
                    let (factors, entries) = row.split_at_mut(end);
                    let factors = [
                        factors[first],
                        factors[first + 1],
                        factors[first + 2],
                        factors[first + 3],
                    ];
                    // Zero blocks are common in tangents of several coordinates.
                    if factors.iter().all(|factor| *factor != 0.0) {
                        subtract_four(entries, factors, rows);
                        continue;
                    }
                    for k in 0..FOUR {
                        if factors[k] != 0.0 {
                            subtract(entries, factors[k], rows[k]);
                        }
                    }
                }
            }
            first = end;
        }
        Ok(())
    }
}

/// Finds the pivot of a column and exchanges its row.
#[inline(always)]
fn pivot(size: usize, matrix: &mut [f64], column: usize) -> Result<usize, usize> {
    let mut pivot = column;
    for row in column + 1..size {
        if matrix[row * size + column].abs() > matrix[pivot * size + column].abs() {
            pivot = row;
        }
    }
    let value = matrix[pivot * size + column];
    if value == 0.0 || !value.is_finite() {
        return Err(column);
    }
    if pivot != column {
        let (upper, lower) = matrix.split_at_mut(pivot * size);
        let other = &mut upper[column * size..(column + 1) * size];
        lower[..size].swap_with_slice(other);
    }
    Ok(pivot)
}

/// Computes the factors of a column, and subtracts its contributions from the columns of its panel, which ends before
/// `end`.
#[inline(always)]
fn eliminate(size: usize, matrix: &mut [f64], column: usize, end: usize) {
    let (upper, lower) = matrix.split_at_mut((column + 1) * size);
    let pivot_row = &upper[column * size..];
    for row in lower.chunks_exact_mut(size) {
        let factor = row[column] / pivot_row[column];
        row[column] = factor;
        for j in column + 1..end {
            row[j] -= factor * pivot_row[j];
        }
    }
}

struct Substitute<'a> {
    size: usize,
    factors: &'a [f64],
    columns: usize,
    sides: &'a mut [f64],
}

impl NullaryFnOnce for Substitute<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        substitution::solve_columns(self.size, self.factors, self.columns, self.sides);
    }
}
