//! The tables of an element, their rows in groups of four points.

use super::Row;
use super::four::Four;
use crate::double_double::DoubleDouble;
use crate::scheme::{SchemeRef, SchemeTable, Tables as _};
use crate::step::{continued_ratio, set_extrapolation};
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

/// Elements have up to 16 points at once; beyond, one point after the other.
pub(crate) const MAX_GROUPS: usize = 4;

/// A K × K matrix by columns, the rows in groups of four. Rows beyond the last are copies of it, so that nothing extraordinary happens there.
#[derive(Clone, Debug)]
pub(crate) struct Matrix {
    groups: usize,
    columns: Vec<[f64; 4]>,
}

impl Matrix {
    fn new(points: usize, row_by_row: &[f64]) -> Self {
        let groups = points.div_ceil(4);
        let columns = vec![[0.0; 4]; points * groups];
        let mut matrix = Self { groups, columns };
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

    /// The product with a vector over the points for every coordinate.
    #[inline(always)]
    pub(crate) fn apply<V: Four, const N: usize>(
        &self,
        like: V,
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        like.apply(self, rows, products);
    }

    #[inline(always)]
    pub(super) fn apply_inline<V: Four, const N: usize>(
        &self,
        like: V,
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        match rows.len() {
            1 => self.apply_to::<V, N, 1>(like, rows, products),
            2 => self.apply_to::<V, N, 2>(like, rows, products),
            3 => self.apply_to::<V, N, 3>(like, rows, products),
            _ => self.apply_to::<V, N, MAX_GROUPS>(like, rows, products),
        }
    }

    #[inline(always)]
    fn apply_to<V: Four, const N: usize, const C: usize>(
        &self,
        like: V,
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        let (columns, zero) = (self.columns.as_chunks::<C>().0, like.like(0.0));
        let (whole, rest) = columns.as_chunks::<4>();
        let ([rows], [products]) = (rows.as_chunks::<C>().0, products.as_chunks_mut::<C>().0)
        else {
            return;
        };
        // Two sums, of even and of odd columns: with few coordinates, additions in a row are what takes time.
        if let ([whole], []) = (whole.as_chunks::<C>().0, rest) {
            // Groups without gaps are written out by the compiler.
            for a in 0..N {
                let mut sums = first_two(like, &whole[0], &rows[0][a]);
                add(like, &mut sums, &whole[0][2..], &rows[0][a][2..]);
                for (columns, row) in whole[1..].iter().zip(&rows[1..]) {
                    add(like, &mut sums, columns, &row[a]);
                }
                for c in 0..C {
                    products[c][a] = (sums[0][c] + sums[1][c]).lanes();
                }
            }
            return;
        }
        for a in 0..N {
            let mut sums = [[zero; C]; 2];
            for (columns, row) in whole.iter().zip(rows) {
                add(like, &mut sums, columns, &row[a]);
            }
            if let Some(row) = rows.get(whole.len()) {
                for (column, value) in rest.iter().zip(&row[a]) {
                    let value = like.like(*value);
                    for c in 0..C {
                        sums[0][c] += like.with(column[c]) * value;
                    }
                }
            }
            for c in 0..C {
                products[c][a] = (sums[0][c] + sums[1][c]).lanes();
            }
        }
    }

    /// The columns one after the other, in groups of four lines.
    #[inline(always)]
    pub(crate) fn groups(&self) -> &[[f64; 4]] {
        &self.columns
    }

    /// The columns, padded to groups of four.
    #[inline(always)]
    pub(crate) fn columns(&self) -> core::slice::ChunksExact<'_, f64> {
        self.columns.as_flattened().chunks_exact(4 * self.groups)
    }
}

/// The products of the first two columns with their values.
#[inline(always)]
fn first_two<V: Four, const C: usize>(
    like: V,
    columns: &[[[f64; 4]; C]; 4],
    values: &[f64; 4],
) -> [[V; C]; 2] {
    let mut products = [[like; C]; 2];
    for lane in 0..2 {
        let value = like.like(values[lane]);
        for c in 0..C {
            products[lane][c] = like.with(columns[lane][c]) * value;
        }
    }
    products
}

/// Adds the products of columns with their values.
#[inline(always)]
fn add<V: Four, const C: usize>(
    like: V,
    sums: &mut [[V; C]; 2],
    columns: &[[[f64; 4]; C]],
    values: &[f64],
) {
    for (lane, (column, value)) in columns.iter().zip(values).enumerate() {
        let value = like.like(*value);
        for c in 0..C {
            sums[lane % 2][c] += like.with(column[c]) * value;
        }
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

    /// Σ weight · value over the points of four coordinates at most from `from` on, and what rounding takes from it.
    ///
    /// This is what all steps add up. With products of one rounding each, the energy of a Kepler orbit drifts ten times as fast: weights
    /// and step are the same numbers in every step, and what their products lose is no chance. Without `EXACT` that is left out.
    #[inline(always)]
    pub(crate) fn sums<V: Four, const N: usize, const EXACT: bool>(
        &self,
        like: V,
        rows: &[Row<N>],
        from: usize,
    ) -> (V, V) {
        let (mut high, mut low) = ([like.like(0.0); 4], [like.like(0.0); 4]);
        for (group, ([weight, weight_low], row)) in self.0.iter().zip(rows).enumerate() {
            let (weight, weight_low) = (like.with(*weight), like.with(*weight_low));
            for a in 0..4.min(N - from) {
                let value = like.with(row[from + a]);
                if const { !EXACT } {
                    high[a] += weight * value;
                    continue;
                }
                let (product, rest) = weight.product(value);
                let rest = rest + weight_low * value;
                if group == 0 {
                    (high[a], low[a]) = (product, rest);
                } else {
                    let (sum, lost) = high[a].exact_sum(product);
                    (high[a], low[a]) = (sum, low[a] + (rest + lost));
                }
            }
        }
        // From a register for each coordinate to one for each of four points.
        let [a, b, c, d] = transposed(high);
        if const { !EXACT } {
            return ((a + b) + (c + d), like.like(0.0));
        }
        let [e, f, g, h] = transposed(low);
        let (left, left_low) = a.exact_sum(b);
        let (right, right_low) = c.exact_sum(d);
        let (all, all_low) = left.exact_sum(right);
        let lost = (left_low + right_low) + all_low;
        (all, ((e + f) + (g + h)) + lost)
    }

    /// The weight of one point and what rounding took from it.
    #[inline(always)]
    pub(crate) fn of(&self, point: usize) -> (f64, f64) {
        let [weight, low] = &self.0[point / 4];
        (weight[point % 4], low[point % 4])
    }
}

#[inline(always)]
fn transposed<V: Four>(rows: [V; 4]) -> [V; 4] {
    let like = rows[0];
    let lanes = [
        rows[0].lanes(),
        rows[1].lanes(),
        rows[2].lanes(),
        rows[3].lanes(),
    ];
    let mut columns = [[0.0; 4]; 4];
    for i in 0..4 {
        for j in 0..4 {
            columns[i][j] = lanes[j][i];
        }
    }
    [
        like.with(columns[0]),
        like.with(columns[1]),
        like.with(columns[2]),
        like.with(columns[3]),
    ]
}

/// All tables of an element, and what continues the last one; clones share what no step changes.
#[derive(Clone, Debug)]
pub(crate) struct Tables {
    fixed: Arc<Fixed>,
    /// From the last element to this one, for steps of the ratio that follows; those of ratio one are among the others.
    other: Option<Matrix>,
    ratio: f64,
    scratch: Vec<f64>,
}

/// What no step changes; `low` is what rounding took.
#[derive(Clone, Debug)]
pub(crate) struct Fixed {
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
    /// From one element to the next that is as long.
    continued: Matrix,
}

impl core::ops::Deref for Tables {
    type Target = Fixed;
    #[inline(always)]
    fn deref(&self) -> &Fixed {
        &self.fixed
    }
}

/// The tables computed so far.
#[cfg(feature = "std")]
static KNOWN: std::sync::Mutex<Vec<(crate::Element, Arc<Fixed>)>> =
    std::sync::Mutex::new(Vec::new());

impl Tables {
    /// Of an element that is a Runge–Kutta method. With the feature `std` they are computed once in a program.
    pub(crate) fn of(scheme: &SchemeRef<'_>) -> Self {
        Self {
            fixed: Self::fixed(scheme),
            other: None,
            ratio: 1.0,
            scratch: Vec::new(),
        }
    }

    #[cfg(feature = "std")]
    fn fixed(scheme: &SchemeRef<'_>) -> Arc<Fixed> {
        // A panic elsewhere leaves the list as good as it was.
        let mut known = KNOWN
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, fixed)) = known.iter().find(|(of, _)| *of == scheme.element) {
            return fixed.clone();
        }
        let fixed = Arc::new(Fixed::computed(scheme));
        known.push((scheme.element, fixed.clone()));
        fixed
    }

    #[cfg(not(feature = "std"))]
    fn fixed(scheme: &SchemeRef<'_>) -> Arc<Fixed> {
        Arc::new(Fixed::computed(scheme))
    }

    /// From the last element to this one.
    #[inline(always)]
    pub(crate) fn continued(&self) -> &Matrix {
        self.other.as_ref().unwrap_or(&self.fixed.continued)
    }

    /// Makes `continued` that of steps of this ratio.
    pub(crate) fn set_ratio(&mut self, table: &SchemeTable, ratio: f64) {
        // Far outside the last element its polynomial says nothing; backwards it may be reused.
        let ratio = continued_ratio(ratio);
        if self.ratio != ratio {
            self.continue_by(&table.view(), ratio);
        }
    }

    #[cold]
    fn continue_by(&mut self, scheme: &SchemeRef<'_>, ratio: f64) {
        let points = self.fixed.points;
        self.scratch.resize(points * points, 0.0);
        set_extrapolation(scheme, ratio, &mut self.scratch);
        match &mut self.other {
            Some(matrix) => matrix.set(points, &self.scratch),
            None => self.other = Some(Matrix::new(points, &self.scratch)),
        }
        self.ratio = ratio;
    }
}

impl Fixed {
    fn computed(scheme: &SchemeRef<'_>) -> Self {
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
        // Most steps are as long as the one before.
        let mut continued = vec![0.0; points * points];
        set_extrapolation(scheme, 1.0, &mut continued);
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
            continued: Matrix::new(points, &continued),
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
