//! Arithmetic of the iteration of families, and the sizes that it is judged by.

use super::space::{Leg, Problem, Sizes};
use crate::equations::Increment;
use crate::points::four::Four;
use crate::points::storage::Heap;
use crate::points::sweep::relative;
use crate::points::tables::Matrix;

/// The forces at one coordinate at all points, times a number.
#[inline(always)]
pub(super) fn at_points<V: Four, const G: usize>(
    forces: &[V],
    n: usize,
    a: usize,
    factor: V,
) -> [[f64; 4]; G] {
    let mut values = [[0.0; 4]; G];
    for (group, value) in values.iter_mut().enumerate() {
        *value = (factor * forces[group * n + a]).lanes();
    }
    values
}

/// For each group of points the columns of a matrix, zeros beyond the last.
#[inline(always)]
pub(super) fn rows<V: Four, const G: usize>(like: V, matrix: &Matrix<Heap>) -> [[[V; 4]; G]; G] {
    let mut rows = [[[like.like(0.0); 4]; G]; G];
    for (j, column) in matrix.columns().take(4 * G).enumerate() {
        let column = column.as_chunks::<4>().0;
        for (group, row) in rows.iter_mut().enumerate() {
            row[j / 4][j % 4] = like.with(column[group]);
        }
    }
    rows
}

/// Σ row · values
#[inline(always)]
pub(super) fn product<V: Four, const G: usize>(
    like: V,
    row: &[[V; 4]; G],
    values: &[[f64; 4]; G],
) -> V {
    let mut sum = like.like(0.0);
    for (row, values) in row.iter().zip(values) {
        for lane in 0..4 {
            sum += row[lane] * like.like(values[lane]);
        }
    }
    sum
}

/// sum + weight · value
#[inline(always)]
pub(super) fn add_exactly<V: Four>(sum: &mut (V, V), (weight, weight_low): (f64, f64), value: V) {
    let (product, rest) = value.like(weight).product(value);
    let (high, lost) = sum.0.exact_sum(product);
    let rest = (rest + value.like(weight_low) * value) + lost;
    *sum = (high, sum.1 + rest);
}

/// What increments are compared with.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    h: f64,
    q: f64,
    velocity: f64,
}

impl Scale {
    pub(super) fn of(problem: &Problem, leg: Leg<'_>) -> Self {
        Self {
            h: leg.h,
            q: largest(&leg.start.q),
            velocity: largest(&problem.velocity),
        }
    }

    pub(super) fn increment(&self, Sizes { changed, size }: Sizes) -> Increment {
        let h = self.h;
        let velocity = relative(h, self.velocity, size, changed);
        let moved = self.velocity + h.abs() * size;
        let position = relative(h, self.q, moved, 0.5 * h.abs() * changed);
        // Both are NaN, or none is.
        let relative = velocity.max(position);
        Increment { relative, position }
    }
}

/// The largest magnitude; NaN if one is.
pub(super) fn largest(values: &[f64]) -> f64 {
    let larger = |a: f64, b: &f64| {
        if a.is_nan() || a >= b.abs() {
            a
        } else {
            b.abs()
        }
    };
    values.iter().fold(0.0, larger)
}
