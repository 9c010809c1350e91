//! The tables of an element, their rows in groups of four points.

use crate::double_double::DoubleDouble;
use crate::method::{continued_ratio, set_extrapolation};
use crate::registers::storage::{
    Array, Fixed, Inline, Lines, MAX_GROUPS, Matrix, Storage, Weights,
};
use crate::scheme::{self, Scheme, SchemeRef};

/// Sets the columns of a matrix given row by row.
const fn set_columns(points: usize, row_by_row: &[f64], columns: &mut [[f64; 4]]) {
    let groups = points.div_ceil(4);
    let mut j = 0;
    while j < points {
        let mut i = 0;
        while i < 4 * groups {
            let row = if i < points { i } else { points - 1 };
            columns[j * groups + i / 4][i % 4] = row_by_row[row * points + j];
            i += 1;
        }
        j += 1;
    }
}

const fn set_weights(high: &[f64], low: &[f64], groups: &mut [[[f64; 4]; 2]]) {
    let mut l = 0;
    while l < high.len() {
        groups[l / 4][0][l % 4] = high[l];
        groups[l / 4][1][l % 4] = low[l];
        l += 1;
    }
}

/// The numbers of these tables, to be filled.
pub(super) struct Target<'a> {
    pub(super) nodes: &'a mut [[f64; 4]],
    pub(super) reach: &'a mut [[f64; 4]],
    pub(super) reach_low: &'a mut [[f64; 4]],
    pub(super) once: &'a mut [[f64; 4]],
    pub(super) once_low: &'a mut [[f64; 4]],
    pub(super) twice: &'a mut [[f64; 4]],
    pub(super) twice_low: &'a mut [[f64; 4]],
    pub(super) weights: &'a mut [[[f64; 4]; 2]],
    pub(super) lever: &'a mut [[[f64; 4]; 2]],
    pub(super) continued: &'a mut [[f64; 4]],
}

/// The most points.
const MAX_POINTS: usize = 4 * MAX_GROUPS;

impl Target<'_> {
    pub(super) const fn fill(&mut self, scheme: &SchemeRef<'_>) {
        let points = scheme.nodes.len();
        let mut matrix = [0.0; MAX_POINTS * MAX_POINTS];
        let mut matrix_low = [0.0; MAX_POINTS * MAX_POINTS];
        let (mut lever, mut lever_low) = ([0.0; MAX_POINTS], [0.0; MAX_POINTS]);
        let mut j = 0;
        while j < points {
            let mut i = 0;
            while i < points {
                let (mut sum, mut k) = (DoubleDouble::ZERO, 0);
                while k < points {
                    let product = coefficient(scheme, i, k).times(coefficient(scheme, k, j));
                    sum = sum.plus(product);
                    k += 1;
                }
                (matrix[i * points + j], matrix_low[i * points + j]) = (sum.high, sum.low);
                i += 1;
            }
            let (mut sum, mut k) = (DoubleDouble::ZERO, 0);
            while k < points {
                let weight = DoubleDouble {
                    high: scheme.weights[k],
                    low: scheme.weights_low[k],
                };
                sum = sum.plus(weight.times(coefficient(scheme, k, j)));
                k += 1;
            }
            (lever[j], lever_low[j]) = (sum.high, sum.low);
            j += 1;
        }
        set_columns(points, &matrix, self.twice);
        set_columns(points, &matrix_low, self.twice_low);
        set_columns(points, scheme.position, self.once);
        set_columns(points, scheme.position_low, self.once_low);
        // Most steps are as long as the one before.
        set_extrapolation(scheme, 1.0, &mut matrix);
        set_columns(points, &matrix, self.continued);
        set_weights(scheme.weights, scheme.weights_low, self.weights);
        let (lever, lever_low) = (lever.split_at(points).0, lever_low.split_at(points).0);
        set_weights(lever, lever_low, self.lever);
        let mut i = 0;
        while i < 4 * self.nodes.len() {
            let l = if i < points { i } else { points - 1 };
            let (mut sum, mut j) = (DoubleDouble::ZERO, 0);
            while j < points {
                sum = sum.plus(coefficient(scheme, l, j));
                j += 1;
            }
            self.nodes[i / 4][i % 4] = scheme.nodes[l];
            self.reach[i / 4][i % 4] = sum.high;
            self.reach_low[i / 4][i % 4] = sum.low;
            i += 1;
        }
    }
}

/// a_ij to twice the precision.
const fn coefficient(scheme: &SchemeRef<'_>, i: usize, j: usize) -> DoubleDouble {
    let at = i * scheme.nodes.len() + j;
    DoubleDouble {
        high: scheme.position[at],
        low: scheme.position_low[at],
    }
}

impl<
    const K: usize,
    const C: usize,
    const FIRST: usize,
    const VARYING: usize,
    const SQUARE: usize,
    const KEPT: usize,
> Fixed<Inline<K, C, FIRST, VARYING, SQUARE, KEPT>>
{
    /// Of an element that is a Runge–Kutta method of K points; of no use where K is zero.
    #[must_use]
    pub const fn new<const POINTS: usize, const U: usize>(scheme: &Scheme<POINTS, U>) -> Self {
        let (table, row) = ([[[0.0; 4]; C]; K], [[0.0; 4]; C]);
        let (mut nodes, mut reach, mut reach_low) = (row, row, row);
        let (mut once, mut once_low) = (table, table);
        let (mut twice, mut twice_low, mut continued) = (table, table, table);
        let (mut weights, mut lever) = ([[[0.0; 4]; 2]; C], [[[0.0; 4]; 2]; C]);
        if K > 0 {
            let mut target = Target {
                nodes: &mut nodes,
                reach: &mut reach,
                reach_low: &mut reach_low,
                once: once.as_flattened_mut(),
                once_low: once_low.as_flattened_mut(),
                twice: twice.as_flattened_mut(),
                twice_low: twice_low.as_flattened_mut(),
                weights: &mut weights,
                lever: &mut lever,
                continued: continued.as_flattened_mut(),
            };
            target.fill(&scheme.as_view());
        }
        Self {
            points: K,
            groups: C,
            nodes: Array(nodes),
            reach: Array(reach),
            reach_low: Array(reach_low),
            once: Matrix::of(once),
            once_low: Matrix::of(once_low),
            twice: Matrix::of(twice),
            twice_low: Matrix::of(twice_low),
            weights: Weights(Array(weights)),
            lever: Weights(Array(lever)),
            continued: Matrix::of(continued),
        }
    }
}

impl<
    const K: usize,
    const C: usize,
    const FIRST: usize,
    const VARYING: usize,
    const SQUARE: usize,
    const KEPT: usize,
> Matrix<Inline<K, C, FIRST, VARYING, SQUARE, KEPT>>
{
    const fn of(columns: [[[f64; 4]; C]; K]) -> Self {
        Self {
            #[cfg(feature = "alloc")]
            groups: C,
            columns: Lines(columns),
        }
    }
}

/// All tables of an element, and what continues the last one.
#[derive(Clone, Debug)]
pub struct Tables<S: Storage> {
    fixed: S::Fixed,
    /// From the last element to this one, for steps of the ratio that follows; those of ratio one are among the others.
    other: Option<Matrix<S>>,
    ratio: f64,
}

impl<S: Storage> Tables<S> {
    pub(crate) fn new(fixed: S::Fixed) -> Self {
        Self {
            fixed,
            other: None,
            ratio: 1.0,
        }
    }

    /// From the last element to this one.
    #[inline(always)]
    pub(crate) fn continued(&self) -> &Matrix<S> {
        self.other.as_ref().unwrap_or(&self.fixed.continued)
    }

    /// Makes `continued` that of a step of length `h` after one of length `last`.
    #[inline(always)]
    pub(crate) fn continue_with(&mut self, scheme: &impl scheme::Tables, h: f64, last: f64) {
        // Mostly there is nothing to divide.
        if h != last || self.ratio != 1.0 {
            self.set_ratio(scheme, h / last);
        }
    }

    /// Makes `continued` that of steps of this ratio.
    #[inline]
    pub(crate) fn set_ratio(&mut self, scheme: &impl scheme::Tables, ratio: f64) {
        // Far outside the last element its polynomial says nothing; backwards it may be reused.
        let ratio = continued_ratio(ratio);
        if self.ratio != ratio {
            self.continue_by(&scheme.view(), ratio);
        }
    }

    #[cold]
    fn continue_by(&mut self, scheme: &SchemeRef<'_>, ratio: f64) {
        let mut matrix = [0.0; MAX_POINTS * MAX_POINTS];
        set_extrapolation(scheme, ratio, &mut matrix);
        let empty = || self.fixed.continued.clone();
        let other = self.other.get_or_insert_with(empty);
        set_columns(self.fixed.points, &matrix, &mut other.columns);
        self.ratio = ratio;
    }
}

impl<S: Storage> core::ops::Deref for Tables<S> {
    type Target = Fixed<S>;
    #[inline(always)]
    fn deref(&self) -> &Fixed<S> {
        &self.fixed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Element;
    use crate::scheme::{SchemeTable, Tables as _};

    /// b_i a_ij + b_j a_ji = b_i b_j: no drift comes from the tables.
    #[test]
    fn coefficients_are_symplectic_beyond_double_precision() {
        for nodes in 2..=12 {
            let table = SchemeTable::new(Element::mixed(nodes)).unwrap();
            let scheme = table.view();
            let points = scheme.points();
            let a = |i: usize, j: usize| DoubleDouble {
                high: scheme.position[i * points + j],
                low: scheme.position_low[i * points + j],
            };
            let b = |i: usize| DoubleDouble {
                high: scheme.weights[i],
                low: scheme.weights_low[i],
            };
            for i in 0..points {
                for j in 0..points {
                    let sum = b(i).times(a(i, j)).plus(b(j).times(a(j, i)));
                    let defect = sum.minus(b(i).times(b(j))).magnitude();
                    // The last digits of double-double numbers below one.
                    assert!(defect < 1e-31, "{nodes} nodes: {defect:.1e}");
                }
            }
        }
    }
}
