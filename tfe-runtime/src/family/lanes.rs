//! Arithmetic of the fixed-point iteration of models of run-time length.

use crate::legendre::larger;
use crate::registers::four::Four;
use crate::registers::storage::{Heap, Matrix};

/// The forces on one coordinate at all points, times a factor.
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

/// The columns of a matrix for each group of points, with zeros beyond the last point.
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
    let mut sum = row[0][0] * like.like(values[0][0]);
    for group in 0..G {
        for lane in usize::from(group == 0)..4 {
            sum = row[group][lane].times_plus(like.like(values[group][lane]), sum);
        }
    }
    sum
}

/// The largest magnitude so far in each lane, and a sum that becomes NaN if a value is not finite.
#[derive(Clone, Copy)]
pub(super) struct Largest<V> {
    size: V,
    sum: V,
}

impl<V: Four> Largest<V> {
    #[inline(always)]
    pub(super) fn none(like: V) -> Self {
        let zero = like.like(0.0);
        Self {
            size: zero,
            sum: zero,
        }
    }

    #[inline(always)]
    pub(super) fn raise(&mut self, value: V) {
        self.size = value.abs().larger(self.size);
        self.sum += value;
    }

    /// The maximum of all lanes; NaN if one value was not finite.
    #[inline(always)]
    pub(super) fn get(self) -> f64 {
        let [a, b, c, d] = (self.size + self.sum * self.sum.like(0.0)).lanes();
        larger(larger(a, b), larger(c, d)) + 0.0 * ((a + b) + (c + d))
    }
}
