//! Products of the tables with numbers of eight trajectories.

use super::group::Row;
use super::pair::Eight;
use crate::points::tables::{Matrix, Weights};

/// The product of a K × K matrix with a vector over the points, for every coordinate.
#[inline(always)]
pub(super) fn apply<V: Eight, const N: usize>(
    like: V,
    matrix: &Matrix,
    rows: &[Row<N>],
    products: &mut [Row<N>],
) {
    let (blocks, rest) = products.as_chunks_mut::<2>();
    let done = 2 * blocks.len();
    for (block, products) in blocks.iter_mut().enumerate() {
        apply_block(like, matrix, 2 * block, rows, products);
    }
    for (line, product) in rest.iter_mut().enumerate() {
        let product = core::array::from_mut(product);
        apply_block(like, matrix, done + line, rows, product);
    }
}

/// Lines `from` and B − 1 that follow.
#[inline(always)]
fn apply_block<V: Eight, const N: usize, const B: usize>(
    like: V,
    matrix: &Matrix,
    from: usize,
    rows: &[Row<N>],
    products: &mut [Row<N>; B],
) {
    for a in 0..N {
        let mut sums = [like.like(0.0); B];
        for (column, row) in matrix.columns().zip(rows) {
            let value = like.with(row[a]);
            let column = &column[from..from + B];
            for line in 0..B {
                sums[line] += like.like(column[line]) * value;
            }
        }
        for line in 0..B {
            products[line][a] = sums[line].lanes();
        }
    }
}

/// Σ weight · value over the points of coordinate `a`, and what rounding takes from it, as in [`Weights::sums`].
#[inline(always)]
pub(super) fn sum<V: Eight, const N: usize, const EXACT: bool>(
    like: V,
    weights: &Weights,
    rows: &[Row<N>],
    a: usize,
) -> (V, V) {
    let (mut high, mut low) = (like.like(0.0), like.like(0.0));
    for (l, row) in rows.iter().enumerate() {
        let (weight, weight_low) = weights.of(l);
        let value = like.with(row[a]);
        if const { !EXACT } {
            high += like.like(weight) * value;
            continue;
        }
        let (product, rest) = like.like(weight).product(value);
        let (sum, lost) = high.exact_sum(product);
        high = sum;
        low += (rest + like.like(weight_low) * value) + lost;
    }
    (high, low)
}
