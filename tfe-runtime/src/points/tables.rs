//! The tables of an element, their rows in groups of four.

use super::four::Four;
use crate::double_double::DoubleDouble;
use crate::scheme::{SchemeRef, SchemeTable, Tables as _};
use crate::step::set_extrapolation;
use alloc::vec;
use alloc::vec::Vec;

/// Elements have up to 16 points at once; beyond, one point after the other.
pub(super) const MAX_GROUPS: usize = 4;

/// A K × K matrix by columns, the rows in groups of four. Rows beyond the last are copies of it, so that nothing extraordinary happens there.
#[derive(Clone, Debug)]
pub(crate) struct Matrix {
    groups: usize,
    columns: Vec<[f64; 4]>,
}

impl Matrix {
    fn new(points: usize, row_by_row: &[f64]) -> Self {
        let groups = points.div_ceil(4);
        let mut matrix = Self {
            groups,
            columns: vec![[0.0; 4]; points * groups],
        };
        matrix.set(points, row_by_row);
        matrix
    }

    fn set(&mut self, points: usize, row_by_row: &[f64]) {
        for (j, column) in self.columns.chunks_exact_mut(self.groups).enumerate() {
            for (i, entry) in column.as_flattened_mut().iter_mut().enumerate() {
                *entry = row_by_row[i.min(points - 1) * points + j];
            }
        }
    }

    /// The product with a vector over the points for every coordinate; `rows` and `products` have one row of groups a coordinate.
    #[inline(always)]
    pub(crate) fn apply<V: Four>(&self, like: V, rows: &[[f64; 4]], products: &mut [[f64; 4]]) {
        match self.groups {
            1 => self.apply_to::<V, 1>(like, rows, products),
            2 => self.apply_to::<V, 2>(like, rows, products),
            3 => self.apply_to::<V, 3>(like, rows, products),
            _ => self.apply_to::<V, MAX_GROUPS>(like, rows, products),
        }
    }

    #[inline(always)]
    fn apply_to<V: Four, const C: usize>(
        &self,
        like: V,
        rows: &[[f64; 4]],
        products: &mut [[f64; 4]],
    ) {
        let columns = self.columns.as_chunks::<C>().0;
        let (rows, products) = (rows.as_chunks::<C>().0, products.as_chunks_mut::<C>().0);
        for (row, product) in rows.iter().zip(products) {
            let mut sum = [like.like(0.0); C];
            for (column, value) in columns.iter().zip(row.as_flattened()) {
                let value = like.like(*value);
                for c in 0..C {
                    sum[c] += like.with(column[c]) * value;
                }
            }
            for c in 0..C {
                product[c] = sum[c].lanes();
            }
        }
    }

    /// The columns, padded to groups of four.
    #[inline(always)]
    pub(crate) fn columns(&self) -> core::slice::ChunksExact<'_, f64> {
        self.columns.as_flattened().chunks_exact(4 * self.groups)
    }
}

/// A weight for each point and what rounding took from it; zeros beyond the last.
#[derive(Clone, Debug)]
pub(crate) struct Weights(Vec<[[f64; 4]; 2]>);

impl Weights {
    fn new(high: &[f64], low: &[f64]) -> Self {
        let mut groups = vec![[[0.0; 4]; 2]; high.len().div_ceil(4)];
        for (l, (high, low)) in high.iter().zip(low).enumerate() {
            groups[l / 4][0][l % 4] = *high;
            groups[l / 4][1][l % 4] = *low;
        }
        Self(groups)
    }

    /// Σ weight · value, and what rounding takes from it.
    ///
    /// This is what all steps add up. With products of one rounding each, the energy of a Kepler orbit drifts ten times as fast: weights
    /// and step are the same numbers in every step, and what their products lose is no chance.
    #[inline(always)]
    pub(crate) fn sum<V: Four>(&self, like: V, row: &[[f64; 4]]) -> (f64, f64) {
        let (mut high, mut low) = (like.like(0.0), like.like(0.0));
        for ([weight, weight_low], value) in self.0.iter().zip(row) {
            let value = like.with(*value);
            let (product, rest) = like.with(*weight).product(value);
            let (sum, lost) = high.exact_sum(product);
            high = sum;
            low += (rest + like.with(*weight_low) * value) + lost;
        }
        let ([a, b, c, d], [e, f, g, h]) = (high.lanes(), low.lanes());
        let (left, right) = (DoubleDouble::sum(a, b), DoubleDouble::sum(c, d));
        let all = DoubleDouble::sum(left.high, right.high);
        let lost = (left.low + right.low) + all.low;
        (all.high, ((e + f) + (g + h)) + lost)
    }

    /// The weight of one point and what rounding took from it.
    #[inline(always)]
    pub(crate) fn of(&self, point: usize) -> (f64, f64) {
        let [weight, low] = &self.0[point / 4];
        (weight[point % 4], low[point % 4])
    }
}

/// All tables; `low` is what rounding took.
#[derive(Clone, Debug)]
pub(crate) struct Tables {
    pub(crate) points: usize,
    pub(crate) groups: usize,
    /// c
    pub(crate) nodes: Vec<[f64; 4]>,
    /// A 1: how far a constant velocity reaches. It is c for collocation methods only.
    pub(crate) reach: Vec<[f64; 4]>,
    pub(crate) reach_low: Vec<[f64; 4]>,
    /// A
    pub(crate) once: Matrix,
    pub(crate) once_low: Matrix,
    /// A²: what two integrations make of accelerations.
    pub(crate) twice: Matrix,
    pub(crate) twice_low: Matrix,
    /// b
    pub(crate) weights: Weights,
    /// bᵀA
    pub(crate) lever: Weights,
    /// From the last element to this one, for steps of the ratio that follows.
    pub(crate) continued: Matrix,
    ratio: Option<f64>,
    scratch: Vec<f64>,
}

impl Tables {
    /// Of an element that is a Runge–Kutta method.
    pub(crate) fn new(scheme: &SchemeRef<'_>) -> Self {
        let points = scheme.points();
        let coefficient = |i: usize, j: usize| DoubleDouble {
            high: scheme.position[i * points + j],
            low: scheme.position_low[i * points + j],
        };
        let weight = |j: usize| DoubleDouble {
            high: scheme.weights[j],
            low: scheme.weights_low[j],
        };
        let product = |left: &dyn Fn(usize) -> DoubleDouble, j: usize| {
            (0..points).fold(DoubleDouble::ZERO, |sum, k| {
                sum.plus(left(k).times(coefficient(k, j)))
            })
        };
        let twice: Vec<_> = (0..points * points)
            .map(|ij| product(&|k| coefficient(ij / points, k), ij % points))
            .collect();
        let lever: Vec<_> = (0..points).map(|j| product(&weight, j)).collect();
        let high = |of: &[DoubleDouble]| of.iter().map(|x| x.high).collect::<Vec<_>>();
        let low = |of: &[DoubleDouble]| of.iter().map(|x| x.low).collect::<Vec<_>>();
        let mut nodes = vec![[0.0; 4]; points.div_ceil(4)];
        let (mut reach, mut reach_low) = (nodes.clone(), nodes.clone());
        for l in 0..4 * nodes.len() {
            let (group, lane, l) = (l / 4, l % 4, l.min(points - 1));
            let sum = |sum: DoubleDouble, j| sum.plus(coefficient(l, j));
            let sum = (0..points).fold(DoubleDouble::ZERO, sum);
            nodes[group][lane] = scheme.nodes[l];
            (reach[group][lane], reach_low[group][lane]) = (sum.high, sum.low);
        }
        let scratch = vec![0.0; points * points];
        Self {
            points,
            groups: nodes.len(),
            nodes,
            reach,
            reach_low,
            once: Matrix::new(points, scheme.position),
            once_low: Matrix::new(points, scheme.position_low),
            twice: Matrix::new(points, &high(&twice)),
            twice_low: Matrix::new(points, &low(&twice)),
            weights: Weights::new(scheme.weights, scheme.weights_low),
            lever: Weights::new(&high(&lever), &low(&lever)),
            continued: Matrix::new(points, &scratch),
            ratio: None,
            scratch,
        }
    }

    /// Makes `continued` that of steps of this ratio.
    pub(crate) fn set_ratio(&mut self, table: &SchemeTable, ratio: f64) {
        // Far outside the last element its polynomial says nothing; backwards it may be reused.
        let near = (-1.5..=3.0).contains(&ratio);
        let fraction = if near { ratio } else { 0.0 };
        if self.ratio != Some(fraction) {
            set_extrapolation(&table.view(), fraction, &mut self.scratch);
            self.continued.set(self.points, &self.scratch);
            self.ratio = Some(fraction);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Element;

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
