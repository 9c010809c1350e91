//! Forward and backward substitution in larger systems: each row is summed in four independent partial sums, so that no
//! addition waits for the one before it.

/// The number of partial sums.
pub(super) const FOUR: usize = 4;

/// Below this number of rows, several partial sums are not worth their cost.
pub(super) const LARGE: usize = 16;

/// Solves L U x = b in place, row by row; the rows of b have already been exchanged.
///
/// The rows of large systems form blocks of four. Factors outside the own block are summed in four partial sums, each
/// with every fourth factor.
pub(super) fn solve(size: usize, factors: &[f64], vector: &mut [f64]) {
    let whole = if size < LARGE { 0 } else { size / FOUR * FOUR };
    for row in 0..size {
        let own = &factors[row * size..(row + 1) * size];
        let block = if row < whole { row / FOUR * FOUR } else { 0 };
        vector[row] -= product(&own[..block], &vector[..block]);
        for j in block..row {
            vector[row] -= own[j] * vector[j];
        }
    }
    for row in (0..size).rev() {
        let own = &factors[row * size..(row + 1) * size];
        let end = if row < whole {
            row / FOUR * FOUR + FOUR
        } else {
            size
        };
        vector[row] -= product(&own[end..], &vector[end..]);
        for j in row + 1..end {
            vector[row] -= own[j] * vector[j];
        }
        vector[row] /= own[row];
    }
}

/// A row times a vector.
#[inline(never)] // small programs
fn product(row: &[f64], vector: &[f64]) -> f64 {
    let (rows, rest) = row.as_chunks::<FOUR>();
    let (vectors, others) = vector.as_chunks::<FOUR>();
    let mut sums = [0.0; FOUR];
    for (row, vector) in rows.iter().zip(vectors) {
        for lane in 0..FOUR {
            sums[lane] += row[lane] * vector[lane];
        }
    }
    let rest = rest.iter().zip(others);
    rest.fold(total(sums), |sum, (factor, other)| sum + factor * other)
}

/// The sum of four.
#[inline(always)]
pub(super) fn total([a, b, c, d]: [f64; FOUR]) -> f64 {
    (a + b) + (c + d)
}

/// Solves Uᵀ Lᵀ x = b in place, one row of factors after the other.
#[inline(always)]
pub(super) fn solve_transposed(size: usize, factors: &[f64], vector: &mut [f64]) {
    for (j, row) in factors.chunks_exact(size).enumerate() {
        let (done, rest) = vector.split_at_mut(j + 1);
        let value = done[j] / row[j];
        done[j] = value;
        for (entry, factor) in rest.iter_mut().zip(&row[j + 1..]) {
            *entry -= factor * value;
        }
    }
    for (j, row) in factors.chunks_exact(size).enumerate().rev() {
        let (rest, done) = vector.split_at_mut(j);
        let value = done[0];
        for (entry, factor) in rest.iter_mut().zip(row) {
            *entry -= factor * value;
        }
    }
}

/// Solves L U X = B in place, with many right-hand sides at once, row by row; the rows of B have already been
/// exchanged.
#[inline(always)]
pub(super) fn solve_columns(size: usize, factors: &[f64], columns: usize, sides: &mut [f64]) {
    for k in 0..size {
        let (done, rest) = sides.split_at_mut(k * columns);
        let factors = &factors[k * size..k * size + k];
        subtract_all(&mut rest[..columns], factors, done);
    }
    for k in (0..size).rev() {
        let (rest, done) = sides.split_at_mut((k + 1) * columns);
        let row = &mut rest[k * columns..];
        let factors = &factors[k * size + k..(k + 1) * size];
        subtract_all(row, &factors[1..], done);
        let inverse = 1.0 / factors[0];
        for entry in row {
            *entry *= inverse;
        }
    }
}

/// row −= Σ factor · other, one term after the other.
#[inline(always)]
fn subtract_all(row: &mut [f64], factors: &[f64], others: &[f64]) {
    let columns = row.len();
    let (fours, rest) = factors.as_chunks::<FOUR>();
    for (at, factors) in fours.iter().enumerate() {
        let first = at * FOUR * columns;
        let other = |k: usize| &others[first + k * columns..first + (k + 1) * columns];
        subtract_four(row, *factors, [other(0), other(1), other(2), other(3)]);
    }
    for (k, factor) in rest.iter().enumerate() {
        let first = (fours.len() * FOUR + k) * columns;
        subtract(row, *factor, &others[first..first + columns]);
    }
}

#[inline(always)]
pub(super) fn subtract(row: &mut [f64], factor: f64, other: &[f64]) {
    for (entry, other) in row.iter_mut().zip(other) {
        *entry -= factor * other;
    }
}

#[inline(always)]
pub(super) fn subtract_four(row: &mut [f64], factors: [f64; FOUR], others: [&[f64]; FOUR]) {
    let length = row.len();
    let others = others.map(|other| &other[..length]);
    for j in 0..length {
        let mut entry = row[j];
        for k in 0..FOUR {
            entry -= factors[k] * others[k][j];
        }
        row[j] = entry;
    }
}
