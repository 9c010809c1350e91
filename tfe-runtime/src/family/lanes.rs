//! Arithmetic of the iteration of families, and the sizes that it is judged by.

use super::FamilyModel;
use super::space::{Leg, Problem};
use crate::equations::Increment;
use crate::model::Form;
use crate::points::four::Four;
use crate::points::tables::Matrix;

/// L_q + Q, or Q − H_q.
#[inline(always)]
pub(super) fn total<V: Four, M: FamilyModel>(by_q: V, force: V) -> V {
    match M::FORM {
        Form::Lagrangian => by_q + force,
        Form::Hamiltonian => force - by_q,
    }
}

/// The same where there is no Q.
#[inline(always)]
pub(super) fn alone<V: Four, M: FamilyModel>(by_q: V) -> V {
    match M::FORM {
        Form::Lagrangian => by_q,
        Form::Hamiltonian => -by_q,
    }
}

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
pub(super) fn rows<V: Four, const G: usize>(like: V, matrix: &Matrix) -> [[[V; 4]; G]; G] {
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

/// start + h · rate, each a number and what rounding took from it.
#[inline(always)]
pub(super) fn moved_exactly<V: Four>(h: V, rate: (V, V), start: (V, V)) -> (V, V) {
    let (product, rest) = h.product(rate.0);
    let rest = (rest + h * rate.1) + start.1;
    let (sum, lost) = start.0.exact_sum(product);
    sum.exact_sum(lost + rest)
}

/// Four of the numbers; zeros beyond the last.
#[inline(always)]
pub(super) fn four<V: Four>(like: V, numbers: &[f64], at: usize) -> V {
    if let Some(four) = numbers[at..].first_chunk::<4>() {
        return like.with(*four);
    }
    let mut four = [0.0; 4];
    four[..numbers.len() - at].copy_from_slice(&numbers[at..]);
    like.with(four)
}

/// Four of the numbers, as far as there are so many.
#[inline(always)]
pub(super) fn put<V: Four>(four: V, numbers: &mut [f64], at: usize) {
    let last = numbers.len().min(at + 4);
    numbers[at..last].copy_from_slice(&four.lanes()[..last - at]);
}

/// The largest of four; NaN if one is.
#[inline(always)]
pub(super) fn over_lanes<V: Four>(four: V) -> f64 {
    let [a, b, c, d] = four.lanes();
    a.max(b).max(c.max(d)) + 0.0 * ((a + b) + (c + d))
}

/// What increments are compared with.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    h: f64,
    q: f64,
    velocity: f64,
}

impl Scale {
    pub(super) fn of(problem: &Problem, leg: &Leg<'_>) -> Self {
        Self {
            h: leg.h,
            q: largest(&leg.start.q),
            velocity: largest(&problem.velocity),
        }
    }

    /// Of the largest change of an acceleration and the largest one.
    pub(super) fn increment(&self, changed: f64, size: f64) -> Increment {
        let h = self.h;
        let velocity = relative(h, self.velocity, size, changed);
        let moved = self.velocity + h.abs() * size;
        let position = relative(h, self.q, moved, 0.5 * h.abs() * changed);
        // Both are NaN, or none is.
        let relative = velocity.max(position);
        Increment { relative, position }
    }
}

/// |h δ| over the larger one of start and |h x|; zero over zero is zero, NaN stays NaN.
pub(super) fn relative(h: f64, start: f64, x: f64, step: f64) -> f64 {
    if step == 0.0 {
        return 0.0;
    }
    h.abs() * step / start.max(h.abs() * x)
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
