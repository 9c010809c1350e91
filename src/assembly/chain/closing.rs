//! The closing system: the small dense system in (ŷ_0, ŷ_E, γ) that remains of a chain.

use super::equations::{Equations, Shape, Singular};
use super::sweep::Sweep;
use crate::periodic_schur::{exponent, power_of_two};

/// A pivot below this fraction of the largest counts as zero.
///
/// Rows and columns are scaled to entries of order one. The smallest pivot of a singular system is then rounding error:
/// a few ε, from the reflections and from the elimination here. 1e-14 are 45 ε.
const THRESHOLD: f64 = 1e-14;

/// A square system with its right sides, solved by elimination with full pivoting.
#[derive(Clone, Debug)]
pub(super) struct Closing {
    size: usize,
    /// The length of a row: the number of unknowns plus the number of right sides.
    width: usize,
    rows: Vec<f64>,
    /// The scale of each column: the unknown is the solved value times its scale.
    column_scales: Vec<f64>,
    /// The unknown that each column belongs to.
    order: Vec<usize>,
    /// The solution by unknowns, with all right sides of an unknown side by side.
    solution: Vec<f64>,
    /// The ratio of the smallest to the largest pivot.
    smallest: f64,
}

impl Closing {
    pub(super) fn new(shape: &Shape) -> Self {
        let size = shape.closing();
        let width = size + shape.rights;
        Self {
            size,
            width,
            rows: vec![0.0; size * width],
            column_scales: vec![1.0; size],
            order: (0..size).collect(),
            solution: vec![0.0; size * shape.rights],
            smallest: 0.0,
        }
    }

    /// Writes the rows: the relation left by the elimination, the closure, the dense rows.
    pub(super) fn load(&mut self, shape: &Shape, equations: &Equations, sweep: &Sweep) {
        let (m, c) = (shape.block, shape.closure());
        for (i, row) in self.rows.chunks_exact_mut(self.width).enumerate() {
            let given = if i < m {
                copy_swept(row, sweep.relation(i), m);
                0.0
            } else if i < m + c {
                copy_closure(row, shape, equations, sweep.scales(), i - m);
                0.0
            } else {
                let (from, given) = sweep.dense(shape, i - m - c);
                copy_swept(row, from, m);
                // If the elimination has left little of the row, its error is relative to the size that the row had.
                given
            };
            scale_row(row, given, 2 * m, self.size);
        }
        self.scale_globals(2 * m, sweep.global_sizes());
    }

    /// Scales the global unknowns so that the largest coefficient of each is of order one.
    ///
    /// `in_links` are the largest coefficients in the links. If the elimination has left little of them, the error of
    /// the rest is relative to these.
    fn scale_globals(&mut self, first: usize, in_links: &[f64]) {
        for (j, &size) in (first..).zip(in_links) {
            let rows = || self.rows.chunks_exact(self.width);
            let scale = inverse_power(rows().fold(size, |most, row| most.max(row[j].abs())));
            self.column_scales[j] = scale;
            for row in self.rows.chunks_exact_mut(self.width) {
                row[j] *= scale;
            }
        }
    }

    /// Solves the system; returns the sign of its determinant.
    pub(super) fn solve(&mut self) -> Result<f64, Singular> {
        if !self.rows.iter().all(|x| x.is_finite()) {
            return Err(Singular::NotFinite);
        }
        let (n, width) = (self.size, self.width);
        for (i, unknown) in self.order.iter_mut().enumerate() {
            *unknown = i;
        }
        let mut sign = 1.0;
        let mut largest = 0.0;
        self.smallest = 1.0;
        for step in 0..n {
            let (row, column, size) = self.pivot(step);
            if step == 0 {
                largest = size;
            }
            if !(size > THRESHOLD * largest) {
                let pivot = if largest > 0.0 { size / largest } else { 0.0 };
                return Err(Singular::Rank {
                    rank: step,
                    size: n,
                    pivot,
                });
            }
            self.smallest = self.smallest.min(size / largest);
            if self.bring_to_front(step, row, column) {
                sign = -sign;
            }
            let (above, below) = self.rows.split_at_mut((step + 1) * width);
            let pivot = &above[step * width..];
            sign *= pivot[step].signum();
            for row in below.chunks_exact_mut(width) {
                let factor = row[step] / pivot[step];
                for (x, p) in row[step + 1..].iter_mut().zip(&pivot[step + 1..]) {
                    *x -= factor * p;
                }
            }
        }
        self.substitute();
        Ok(sign)
    }

    /// The position and the size of the largest remaining entry.
    fn pivot(&self, step: usize) -> (usize, usize, f64) {
        let mut best = (step, step, 0.0);
        for i in step..self.size {
            let row = &self.rows[i * self.width..i * self.width + self.size];
            for (j, x) in row.iter().enumerate().skip(step) {
                if x.abs() > best.2 {
                    best = (i, j, x.abs());
                }
            }
        }
        best
    }

    /// Exchanges rows and columns; returns whether this is an odd permutation.
    fn bring_to_front(&mut self, step: usize, row: usize, column: usize) -> bool {
        let width = self.width;
        if row != step {
            let (above, below) = self.rows.split_at_mut(row * width);
            above[step * width..(step + 1) * width].swap_with_slice(&mut below[..width]);
        }
        if column != step {
            for row in self.rows.chunks_exact_mut(width) {
                row.swap(step, column);
            }
            self.order.swap(step, column);
        }
        (row != step) != (column != step)
    }

    /// Back substitution; writes the unknowns in their original order and scale.
    fn substitute(&mut self) {
        let (n, width) = (self.size, self.width);
        let rights = width - n;
        for i in (0..n).rev() {
            let (above, below) = self.rows.split_at_mut((i + 1) * width);
            let row = &mut above[i * width..];
            for j in i + 1..n {
                let solved = &below[(j - i - 1) * width + n..(j - i) * width];
                let factor = row[j];
                for (x, y) in row[n..].iter_mut().zip(solved) {
                    *x -= factor * y;
                }
            }
            let unknown = self.order[i];
            let out = &mut self.solution[unknown * rights..(unknown + 1) * rights];
            let pivot = row[i];
            for (x, out) in row[n..].iter_mut().zip(out) {
                *x /= pivot;
                *out = *x * self.column_scales[unknown];
            }
        }
    }

    /// The ratio of the smallest to the largest pivot, after a successful solution.
    pub(super) fn smallest(&self) -> f64 {
        self.smallest
    }

    /// The solution (ŷ_0, ŷ_E, γ) of one right side.
    pub(super) fn solution(&self, side: usize) -> impl Iterator<Item = f64> {
        let rights = self.width - self.size;
        self.solution
            .chunks_exact(rights.max(1))
            .filter_map(move |unknown| unknown.get(side).copied())
    }
}

/// Copies a row of the elimination, with ŷ_0 before ŷ_E.
fn copy_swept(row: &mut [f64], from: &[f64], m: usize) {
    row[..m].copy_from_slice(&from[2 * m..3 * m]);
    row[m..2 * m].copy_from_slice(&from[..m]);
    row[2 * m..].copy_from_slice(&from[3 * m..]);
}

/// Copies row k of the closure, for the scaled nodes.
fn copy_closure(row: &mut [f64], shape: &Shape, equations: &Equations, scales: &[f64], k: usize) {
    let (m, g) = (shape.block, shape.globals);
    for j in 0..m {
        row[j] = equations.first[k * m + j] * scales[j];
        row[m + j] = equations.last[k * m + j] * scales[j];
    }
    row[2 * m..2 * m + g].copy_from_slice(&equations.closure_globals[k * g..(k + 1) * g]);
    for (x, right) in row[2 * m + g..].iter_mut().zip(&equations.rights) {
        *x = right.closure[k];
    }
}

/// Scales a row by its coefficients of the nodes, or by those of the global unknowns if there are no others.
fn scale_row(row: &mut [f64], given: f64, nodes: usize, size: usize) {
    let largest = |x: &[f64], least| x.iter().fold(least, |most: f64, x| most.max(x.abs()));
    let mut most = largest(&row[..nodes], given);
    if most == 0.0 {
        most = largest(&row[nodes..size], 0.0);
    }
    let scale = inverse_power(most);
    for x in row {
        *x *= scale;
    }
}

/// The power of two that scales a size into [1, 2), within the range of `f64`; 1 for zero.
fn inverse_power(size: f64) -> f64 {
    if size == 0.0 {
        return 1.0;
    }
    power_of_two(-exponent(size).clamp(-1000, 1000))
}
