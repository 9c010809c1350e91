//! Arithmetic of the fixed-point iteration of models of run-time length.

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
