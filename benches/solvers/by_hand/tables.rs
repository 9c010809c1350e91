//! The tables of a Gauss element with K points, as numbers and in C registers.

use super::lanes::Quad;
use tfe::prelude::Element;
use tfe::runtime::scheme::{SchemeTable, Tables as _};

/// The coefficients of a Gauss element with K points.
pub struct Coefficients<const K: usize> {
    pub once: [[f64; K]; K],
    pub twice: [[f64; K]; K],
    /// Extrapolates the rates of the last element to this one.
    pub start: [[f64; K]; K],
    /// A² times the extrapolation.
    pub start_twice: [[f64; K]; K],
    pub nodes: [f64; K],
    pub weights: [f64; K],
    /// bᵀA
    pub lever: [f64; K],
}

impl<const K: usize> Coefficients<K> {
    /// The coefficients of `Mixed` with K points.
    pub fn new() -> Self {
        let table = SchemeTable::new(Element::mixed(K + 1)).expect("a valid element");
        let view = table.view();
        let (mut once, mut twice, mut lever) = ([[0.0; K]; K], [[0.0; K]; K], [0.0; K]);
        for i in 0..K {
            for j in 0..K {
                once[i][j] = view.position[i * K + j];
            }
        }
        for i in 0..K {
            for j in 0..K {
                lever[i] += view.weights[j] * once[j][i];
                for k in 0..K {
                    twice[i][j] += once[i][k] * once[k][j];
                }
            }
        }
        let (c, mut start, mut start_twice) = (view.nodes, [[0.0; K]; K], [[0.0; K]; K]);
        for i in 0..K {
            for j in 0..K {
                start[i][j] = (0..K)
                    .filter(|k| *k != j)
                    .map(|k| (1.0 + c[i] - c[k]) / (c[j] - c[k]))
                    .product();
            }
        }
        for i in 0..K {
            for j in 0..K {
                start_twice[i][j] = (0..K).map(|k| twice[i][k] * start[k][j]).sum();
            }
        }
        let (mut nodes, mut weights) = ([0.0; K], [0.0; K]);
        nodes.copy_from_slice(c);
        weights.copy_from_slice(view.weights);
        Self {
            once,
            twice,
            start,
            start_twice,
            nodes,
            weights,
            lever,
        }
    }
}

/// A matrix by columns, each column in registers.
pub type Matrix<const K: usize, const C: usize> = [[[f64; 4]; C]; K];

/// The coefficients, with all points of a trajectory in registers.
pub struct Tables<const K: usize, const C: usize> {
    pub once: Matrix<K, C>,
    pub twice: Matrix<K, C>,
    pub start: Matrix<K, C>,
    pub start_twice: Matrix<K, C>,
    pub nodes: [[f64; 4]; C],
    pub weights: [[f64; 4]; C],
    pub lever: [[f64; 4]; C],
}

impl<const K: usize, const C: usize> Tables<K, C> {
    /// The coefficients of `Mixed` with K points.
    pub fn new() -> Self {
        let of = Coefficients::<K>::new();
        Self {
            once: columns(&of.once),
            twice: columns(&of.twice),
            start: columns(&of.start),
            start_twice: columns(&of.start_twice),
            nodes: row(&of.nodes),
            weights: row(&of.weights),
            lever: row(&of.lever),
        }
    }
}

/// Lanes beyond the last point are copies of it in matrices, and zero in rows.
fn columns<const K: usize, const C: usize>(matrix: &[[f64; K]; K]) -> Matrix<K, C> {
    let mut columns = [[[0.0; 4]; C]; K];
    for j in 0..K {
        for i in 0..4 * C {
            columns[j][i / 4][i % 4] = matrix[i.min(K - 1)][j];
        }
    }
    columns
}

fn row<const C: usize>(numbers: &[f64]) -> [[f64; 4]; C] {
    let mut row = [[0.0; 4]; C];
    for (i, number) in numbers.iter().enumerate() {
        row[i / 4][i % 4] = *number;
    }
    row
}

/// The product of a matrix and a vector.
#[inline(always)]
pub fn product<const K: usize, const C: usize>(
    matrix: &Matrix<K, C>,
    vector: &[Quad; C],
) -> [Quad; C] {
    let like = vector[0];
    // Two sums, so that only half of the additions wait for each other.
    let mut sums = [[like; C]; 2];
    for j in 0..K {
        let factor = like.splat(vector[j / 4].lanes()[j % 4]);
        for c in 0..C {
            let column = like.load(matrix[j][c]);
            sums[j % 2][c] = if j < 2 {
                column * factor
            } else {
                column.times_plus(factor, sums[j % 2][c])
            };
        }
    }
    for c in 0..C {
        sums[0][c] = sums[0][c] + sums[1][c];
    }
    sums[0]
}

/// Σ weight · value
#[inline(always)]
pub fn weighted<const C: usize>(weights: &[[f64; 4]; C], values: &[Quad; C]) -> f64 {
    let like = values[0];
    let mut sum = like.load(weights[0]) * values[0];
    for c in 1..C {
        sum = like.load(weights[c]).times_plus(values[c], sum);
    }
    sum.sum_of_lanes()
}

/// The largest absolute value.
#[inline(always)]
pub fn largest<const N: usize, const C: usize>(values: &[[Quad; C]; N]) -> f64 {
    let mut largest = values[0][0].abs();
    for row in values {
        for value in row {
            largest = largest.larger(value.abs());
        }
    }
    largest.largest_lane()
}
