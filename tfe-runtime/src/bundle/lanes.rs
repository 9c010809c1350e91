//! Rows of lanes: one number for every coordinate and every trajectory.

use crate::real::Lanes;

/// A vector over the coordinates, for W trajectories.
pub(super) type Row<const N: usize, const W: usize> = [Lanes<W>; N];

/// Zeros.
#[inline(always)]
pub(super) fn zeros<const N: usize, const W: usize>() -> Row<N, W> {
    [Lanes([0.0; W]); N]
}

/// Σ weight · row.
#[inline(always)]
pub(super) fn weighted<const N: usize, const W: usize>(
    weights: &[f64],
    rows: &[Row<N, W>],
) -> Row<N, W> {
    let mut sum = zeros();
    for (weight, row) in weights.iter().zip(rows) {
        add(&mut sum, *weight, row);
    }
    sum
}

/// Adds weight · row.
#[inline(always)]
pub(super) fn add<const N: usize, const W: usize>(
    sum: &mut Row<N, W>,
    weight: f64,
    row: &Row<N, W>,
) {
    for a in 0..N {
        for lane in 0..W {
            sum[a].0[lane] += weight * row[a].0[lane];
        }
    }
}

/// start + (h · rate + low): the small parts meet first.
#[inline(always)]
pub(super) fn moved<const N: usize, const W: usize>(
    start: &Row<N, W>,
    low: &Row<N, W>,
    h: f64,
    rate: &Row<N, W>,
) -> Row<N, W> {
    let mut place = zeros();
    for a in 0..N {
        for lane in 0..W {
            place[a].0[lane] = start[a].0[lane] + (h * rate[a].0[lane] + low[a].0[lane]);
        }
    }
    place
}

/// start + change, rounded, and what rounding took.
#[inline(always)]
pub(super) fn sum<const N: usize, const W: usize>(
    start: &Row<N, W>,
    change: &Row<N, W>,
) -> (Row<N, W>, Row<N, W>) {
    let (mut high, mut low) = (zeros(), zeros());
    for a in 0..N {
        for lane in 0..W {
            let (x, y) = (start[a].0[lane], change[a].0[lane]);
            let rounded = x + y;
            let part = rounded - x;
            high[a].0[lane] = rounded;
            low[a].0[lane] = (x - (rounded - part)) + (y - part);
        }
    }
    (high, low)
}

/// `new` in the lanes that are chosen.
#[inline(always)]
pub(super) fn replace<const N: usize, const W: usize>(
    old: &mut Row<N, W>,
    new: &Row<N, W>,
    chosen: &[bool; W],
) {
    for a in 0..N {
        for lane in 0..W {
            if chosen[lane] {
                old[a].0[lane] = new[a].0[lane];
            }
        }
    }
}

/// The largest magnitudes so far, a lane each; a NaN is passed over.
#[inline(always)]
pub(super) fn raise<const N: usize, const W: usize>(largest: &mut [f64; W], row: &Row<N, W>) {
    for a in 0..N {
        for lane in 0..W {
            let size = row[a].0[lane].abs();
            largest[lane] = if size > largest[lane] {
                size
            } else {
                largest[lane]
            };
        }
    }
}

/// Solves with N × N matrices of their own for every lane, factored by [`factor`].
#[inline(always)]
pub(super) fn solve<const N: usize, const W: usize>(
    factors: &[Row<N, W>; N],
    vector: &mut Row<N, W>,
) {
    for row in 0..N {
        for j in 0..row {
            vector[row] = vector[row] - factors[row][j] * vector[j];
        }
    }
    for row in (0..N).rev() {
        for j in row + 1..N {
            vector[row] = vector[row] - factors[row][j] * vector[j];
        }
        vector[row] = vector[row] * factors[row][row];
    }
}

/// Factors without exchanging rows: a mass matrix is positive definite, and where it is not the iteration does not converge and the lane is
/// left to another method. The diagonal holds the inverse pivots.
#[inline(always)]
pub(super) fn factor<const N: usize, const W: usize>(matrix: &mut [Row<N, W>; N]) {
    for column in 0..N {
        let inverse = Lanes([1.0; W]) / matrix[column][column];
        matrix[column][column] = inverse;
        for row in column + 1..N {
            let factor = matrix[row][column] * inverse;
            matrix[row][column] = factor;
            for j in column + 1..N {
                matrix[row][j] = matrix[row][j] - factor * matrix[column][j];
            }
        }
    }
}
