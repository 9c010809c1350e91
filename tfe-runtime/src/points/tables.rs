//! The tables of an element, their rows in groups of four points.

use super::Row;
use super::four::{Four, Precise};
use super::storage::{Array, Inline, Lines, Storage};
use crate::double_double::DoubleDouble;
use crate::method::{continued_ratio, set_extrapolation};
use crate::scheme::{self, Scheme, SchemeRef};

/// Elements have up to 16 points at once; beyond, one point after the other.
pub(crate) const MAX_GROUPS: usize = 4;

/// A K × K matrix by columns, the rows in groups of four. Rows beyond the last are copies of it, so that nothing extraordinary happens there.
#[derive(Clone, Debug)]
pub struct Matrix<S: Storage> {
    #[cfg(feature = "alloc")]
    groups: usize,
    columns: S::Lines,
}

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

impl<S: Storage> Matrix<S> {
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
        // Conditions that are constants, so that of a known size one is compiled.
        if const { S::GROUPS == 1 } || const { S::GROUPS == 0 } && rows.len() == 1 {
            self.apply_to::<V, N, 1>(like, rows, products);
        } else if const { S::GROUPS == 2 } || const { S::GROUPS == 0 } && rows.len() == 2 {
            self.apply_to::<V, N, 2>(like, rows, products);
        } else if const { S::GROUPS == 3 } || const { S::GROUPS == 0 } && rows.len() == 3 {
            self.apply_to::<V, N, 3>(like, rows, products);
        } else {
            self.apply_to::<V, N, MAX_GROUPS>(like, rows, products);
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
                        sums[0][c] = like.with(column[c]).times_plus(value, sums[0][c]);
                    }
                }
            }
            for c in 0..C {
                products[c][a] = (sums[0][c] + sums[1][c]).lanes();
            }
        }
    }

    /// The columns one after the other, in groups of four lines.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    pub(crate) fn groups(&self) -> &[[f64; 4]] {
        &self.columns
    }

    /// The columns, padded to groups of four.
    #[cfg(feature = "alloc")]
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
            let sum = &mut sums[lane % 2][c];
            *sum = like.with(column[c]).times_plus(value, *sum);
        }
    }
}

/// A weight for each point and what rounding took from it; zeros beyond the last.
#[derive(Clone, Debug)]
pub(crate) struct Weights<S: Storage>(S::Groups<[[f64; 4]; 2]>);

const fn set_weights(high: &[f64], low: &[f64], groups: &mut [[[f64; 4]; 2]]) {
    let mut l = 0;
    while l < high.len() {
        groups[l / 4][0][l % 4] = high[l];
        groups[l / 4][1][l % 4] = low[l];
        l += 1;
    }
}

impl<S: Storage> Weights<S> {
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
                    high[a] = weight.times_plus(value, high[a]);
                    continue;
                }
                let (product, rest) = weight.product(value);
                let rest = weight_low.times_plus(value, rest);
                if group == 0 {
                    (high[a], low[a]) = (product, rest);
                } else {
                    let (sum, lost) = high[a].exact_sum(product);
                    (high[a], low[a]) = (sum, low[a] + (rest + lost));
                }
            }
        }
        if const { N == 1 } {
            // One number at four points: nothing fills registers.
            let (high, low) = sum_of::<_, EXACT>(high[0].lanes(), low[0].lanes());
            return (like.like(high), like.like(low));
        }
        // From a register for each coordinate to one for each of four points.
        sum_of::<_, EXACT>(transposed(high), transposed(low))
    }

    /// The weight of one point and what rounding took from it.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    pub(crate) fn of(&self, point: usize) -> (f64, f64) {
        let [weight, low] = &self.0[point / 4];
        (weight[point % 4], low[point % 4])
    }
}

/// The sum of four numbers and what rounding takes from it, and from each.
#[inline(always)]
fn sum_of<V: Precise, const EXACT: bool>([a, b, c, d]: [V; 4], [e, f, g, h]: [V; 4]) -> (V, V) {
    if const { !EXACT } {
        return ((a + b) + (c + d), a.like(0.0));
    }
    let (left, left_low) = a.exact_sum(b);
    let (right, right_low) = c.exact_sum(d);
    let (all, all_low) = left.exact_sum(right);
    let lost = (left_low + right_low) + all_low;
    (all, ((e + f) + (g + h)) + lost)
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

/// What no step changes; `low` is what rounding took.
#[derive(Clone, Debug)]
pub struct Fixed<S: Storage> {
    pub(crate) points: usize,
    pub(crate) groups: usize,
    /// c
    pub(crate) nodes: S::Groups<[f64; 4]>,
    /// A 1: how far a constant velocity reaches. It is c for collocation methods only.
    pub(crate) reach: S::Groups<[f64; 4]>,
    pub(crate) reach_low: S::Groups<[f64; 4]>,
    /// A
    pub(crate) once: Matrix<S>,
    pub(crate) once_low: Matrix<S>,
    /// A²: what two integrations make of accelerations.
    pub(crate) twice: Matrix<S>,
    pub(crate) twice_low: Matrix<S>,
    /// b
    pub(crate) weights: Weights<S>,
    /// bᵀA
    pub(crate) lever: Weights<S>,
    /// From one element to the next that is as long.
    pub(crate) continued: Matrix<S>,
}

/// The numbers of these tables, to be filled.
struct Target<'a> {
    nodes: &'a mut [[f64; 4]],
    reach: &'a mut [[f64; 4]],
    reach_low: &'a mut [[f64; 4]],
    once: &'a mut [[f64; 4]],
    once_low: &'a mut [[f64; 4]],
    twice: &'a mut [[f64; 4]],
    twice_low: &'a mut [[f64; 4]],
    weights: &'a mut [[[f64; 4]; 2]],
    lever: &'a mut [[[f64; 4]; 2]],
    continued: &'a mut [[f64; 4]],
}

/// The most points.
const MAX_POINTS: usize = 4 * MAX_GROUPS;

impl Target<'_> {
    const fn fill(&mut self, scheme: &SchemeRef<'_>) {
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

#[cfg(feature = "alloc")]
mod heap {
    use super::{Fixed, Matrix, Tables, Target, Weights};
    use crate::points::storage::Heap;
    use crate::scheme::SchemeRef;
    use alloc::sync::Arc;
    use alloc::vec;

    /// The tables computed so far.
    #[cfg(feature = "std")]
    static KNOWN: std::sync::Mutex<std::vec::Vec<(crate::Element, Arc<Fixed<Heap>>)>> =
        std::sync::Mutex::new(std::vec::Vec::new());

    impl Tables<Heap> {
        /// Of an element that is a Runge–Kutta method; clones share what no step changes. With the feature `std` they are computed once in a program.
        pub(crate) fn of(scheme: &SchemeRef<'_>) -> Self {
            Self::new(Self::shared(scheme))
        }

        #[cfg(feature = "std")]
        fn shared(scheme: &SchemeRef<'_>) -> Arc<Fixed<Heap>> {
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
        fn shared(scheme: &SchemeRef<'_>) -> Arc<Fixed<Heap>> {
            Arc::new(Fixed::computed(scheme))
        }
    }

    impl Matrix<Heap> {
        fn empty(points: usize) -> Self {
            let groups = points.div_ceil(4);
            Self {
                groups,
                columns: vec![[0.0; 4]; points * groups],
            }
        }
    }

    impl Fixed<Heap> {
        fn computed(scheme: &SchemeRef<'_>) -> Self {
            let points = scheme.points();
            let groups = points.div_ceil(4);
            let (row, matrix) = (vec![[0.0; 4]; groups], Matrix::empty(points));
            let weights = Weights(vec![[[0.0; 4]; 2]; groups]);
            let mut fixed = Self {
                points,
                groups,
                nodes: row.clone(),
                reach: row.clone(),
                reach_low: row,
                once: matrix.clone(),
                once_low: matrix.clone(),
                twice: matrix.clone(),
                twice_low: matrix.clone(),
                weights: weights.clone(),
                lever: weights,
                continued: matrix,
            };
            let mut target = Target {
                nodes: &mut fixed.nodes,
                reach: &mut fixed.reach,
                reach_low: &mut fixed.reach_low,
                once: &mut fixed.once.columns,
                once_low: &mut fixed.once_low.columns,
                twice: &mut fixed.twice.columns,
                twice_low: &mut fixed.twice_low.columns,
                weights: &mut fixed.weights.0,
                lever: &mut fixed.lever.0,
                continued: &mut fixed.continued.columns,
            };
            target.fill(scheme);
            fixed
        }
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
