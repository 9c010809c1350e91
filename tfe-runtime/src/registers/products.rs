//! Products of the tables of an element with values at its points.

use super::four::Four;
use super::side::each_coordinate;
use super::storage::{MAX_GROUPS, Matrix, Row, Storage, Weights};
use crate::precise::{Precise, add_exactly, exact_term};

impl<S: Storage> Matrix<S> {
    /// The product with a vector over the points, for every coordinate that is requested; the others are unchanged.
    #[inline(always)]
    pub(crate) fn apply<V: Four, const N: usize>(
        &self,
        like: V,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        like.apply(self, wanted, rows, products);
    }

    #[inline(always)]
    pub(super) fn apply_inline<V: Four, const N: usize>(
        &self,
        like: V,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        // Without optimisation, a separate text for each number of groups gains nothing and costs a third of the
        // compile time.
        if const { S::GROUPS == 0 } && cfg!(debug_assertions) {
            self.apply_in_turn(like, wanted, rows, products);
            return;
        }
        // The conditions are constants, so that for a known size only one branch is compiled.
        if const { S::GROUPS == 1 } || const { S::GROUPS == 0 } && rows.len() == 1 {
            self.apply_to::<V, N, 1>(like, wanted, rows, products);
        } else if const { S::GROUPS == 2 } || const { S::GROUPS == 0 } && rows.len() == 2 {
            self.apply_to::<V, N, 2>(like, wanted, rows, products);
        } else if const { S::GROUPS == 3 } || const { S::GROUPS == 0 } && rows.len() == 3 {
            self.apply_to::<V, N, 3>(like, wanted, rows, products);
        } else {
            self.apply_to::<V, N, MAX_GROUPS>(like, wanted, rows, products);
        }
    }

    /// The same to the last bit for any number of groups, with the least code.
    #[inline(always)]
    fn apply_in_turn<V: Four, const N: usize>(
        &self,
        like: V,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        let groups = rows.len();
        let points = self.columns.len() / groups;
        let (has_gaps, paired) = (points != 4 * groups, points / 4 * 4);
        for a in 0..N {
            if !wanted[a] {
                continue;
            }
            for c in 0..groups {
                let mut sums = [like.like(0.0); 2];
                for point in 0..points {
                    let column = like.with(self.columns[point * groups + c]);
                    let value = like.like(rows[point / 4][a][point % 4]);
                    let sum = &mut sums[if point < paired { point % 2 } else { 0 }];
                    *sum = if has_gaps || point > 1 {
                        column.times_plus(value, *sum)
                    } else {
                        column * value
                    };
                }
                let [even, odd] = sums;
                products[c][a] = if paired == 0 { even } else { even + odd }.lanes();
            }
        }
    }

    #[inline(always)]
    fn apply_to<V: Four, const N: usize, const C: usize>(
        &self,
        like: V,
        wanted: &[bool; N],
        rows: &[Row<N>],
        products: &mut [Row<N>],
    ) {
        let (columns, zero) = (self.columns.as_chunks::<C>().0, like.like(0.0));
        let (whole, rest) = columns.as_chunks::<4>();
        let ([rows], [products]) = (rows.as_chunks::<C>().0, products.as_chunks_mut::<C>().0)
        else {
            return;
        };
        // Two sums, of even and of odd columns: with few coordinates, the latency of successive additions dominates.
        if let ([whole], []) = (whole.as_chunks::<C>().0, rest) {
            // The compiler unrolls loops over groups without gaps.
            each_coordinate!(a, N, {
                if !wanted[a] {
                    continue;
                }
                let mut sums = first_two(like, &whole[0], &rows[0][a]);
                add(like, &mut sums, &whole[0][2..], &rows[0][a][2..]);
                for (columns, row) in whole[1..].iter().zip(&rows[1..]) {
                    add(like, &mut sums, columns, &row[a]);
                }
                for c in 0..C {
                    products[c][a] = (sums[0][c] + sums[1][c]).lanes();
                }
            });
            return;
        }
        each_coordinate!(a, N, {
            if !wanted[a] {
                continue;
            }
            let mut sums = [[zero; C]; 2];
            for (columns, row) in whole.iter().zip(rows) {
                add(like, &mut sums, columns, &row[a]);
            }
            if let Some(row) = rows.get(whole.len()) {
                let (even, [x, y, z, _]) = (&mut sums[0], &row[a]);
                // Unrolled: with few points, a loop takes longer than its body.
                match rest {
                    [] => {}
                    [one] => add_column(like, even, one, *x),
                    [one, two] => {
                        add_column(like, even, one, *x);
                        add_column(like, even, two, *y);
                    }
                    // Four would be another whole block.
                    [one, two, three, ..] => {
                        add_column(like, even, one, *x);
                        add_column(like, even, two, *y);
                        add_column(like, even, three, *z);
                    }
                }
            }
            let [even, odd] = sums;
            for c in 0..C {
                // Fewer than four columns are all in one sum.
                let is_one = const { C == 1 } && whole.is_empty();
                products[c][a] = if is_one { even[c] } else { even[c] + odd[c] }.lanes();
            }
        });
    }

    /// The columns one after the other, in groups of four rows.
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
        add_column(like, &mut sums[lane % 2], column, *value);
    }
}

/// Adds the product of a column with its value.
#[inline(always)]
fn add_column<V: Four, const C: usize>(
    like: V,
    sums: &mut [V; C],
    column: &[[f64; 4]; C],
    value: f64,
) {
    let value = like.like(value);
    for c in 0..C {
        sums[c] = like.with(column[c]).times_plus(value, sums[c]);
    }
}

impl<S: Storage> Weights<S> {
    /// Σ weight · value over the points, for at most four coordinates from `from` on, and its rounding error.
    ///
    /// These sums are added up over all steps. If their products were rounded once, the energy of a Kepler orbit would
    /// drift ten times as fast: weights and step are the same numbers in every step, so that the rounding errors of
    /// their products are systematic. Without `EXACT` the rounding errors are not computed.
    #[inline(always)]
    pub(crate) fn sums<V: Four, const N: usize, const EXACT: bool>(
        &self,
        like: V,
        rows: &[Row<N>],
        from: usize,
    ) -> (V, V) {
        let mut sums = [(like.like(0.0), like.like(0.0)); 4];
        for (group, (weight, row)) in self.0.iter().zip(rows).enumerate() {
            let weight = both(like, weight);
            for a in 0..4.min(N - from) {
                let value = like.with(row[from + a]);
                add_term::<_, EXACT>(&mut sums[a], weight, value, group == 0);
            }
        }
        // From one register for each coordinate to one for each of four points.
        sum_of_lanes::<_, EXACT>(sums)
    }

    /// The sums of all coordinates, beside the sums of other values with other weights: [q, p, q, p] for one
    /// coordinate, [q₁, q₂, p₁, p₂] for two.
    #[inline(always)]
    pub(crate) fn sums_beside<V: Four, const N: usize, const EXACT: bool>(
        &self,
        like: V,
        rows: &[Row<N>],
        (others, other_rows): (&Self, &[Row<N>]),
    ) -> (V, V) {
        let mut sums = [(like.like(0.0), like.like(0.0)); 4];
        let ours = self.0.iter().zip(rows);
        let theirs = others.0.iter().zip(other_rows);
        for (group, ((weight, row), (other, other_row))) in ours.zip(theirs).enumerate() {
            let (weight, other) = (both(like, weight), both(like, other));
            for a in 0..N {
                let value = like.with(row[a]);
                add_term::<_, EXACT>(&mut sums[a], weight, value, group == 0);
                let value = like.with(other_row[a]);
                add_term::<_, EXACT>(&mut sums[N + a], other, value, group == 0);
            }
        }
        if const { N == 1 } {
            (sums[2], sums[3]) = (sums[0], sums[1]);
        }
        sum_of_lanes::<_, EXACT>(sums)
    }

    /// The weight of one point and its rounding error.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    pub(crate) fn of(&self, point: usize) -> (f64, f64) {
        let [weight, low] = &self.0[point / 4];
        (weight[point % 4], low[point % 4])
    }
}

/// The weights of four points and their rounding errors.
#[inline(always)]
fn both<V: Four>(like: V, [weight, low]: &[[f64; 4]; 2]) -> (V, V) {
    (like.with(*weight), like.with(*low))
}

/// Adds weight · value.
#[inline(always)]
fn add_term<V: Precise, const EXACT: bool>(
    sum: &mut (V, V),
    weight: (V, V),
    value: V,
    is_first: bool,
) {
    if const { !EXACT } {
        sum.0 = weight.0.times_plus(value, sum.0);
    } else if is_first {
        *sum = exact_term(weight, value);
    } else {
        add_exactly(sum, exact_term(weight, value));
    }
}

/// For each of four registers, the sum over its lanes.
#[inline(always)]
fn sum_of_lanes<V: Four, const EXACT: bool>(sums: [(V, V); 4]) -> (V, V) {
    let [a, b, c, d] = sums;
    sum_of::<_, EXACT>(
        V::transposed([a.0, b.0, c.0, d.0]),
        V::transposed([a.1, b.1, c.1, d.1]),
    )
}

/// The sum of four numbers with their rounding errors, and its own rounding error.
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

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use super::*;
    use crate::lanes::Lanes;
    use crate::registers::storage::Heap;

    /// A matrix and a vector of numbers of all signs and sizes, zeros of both signs among them.
    fn given<const N: usize>(points: usize) -> (Matrix<Heap>, Vec<Row<N>>) {
        let groups = points.div_ceil(4);
        let number = |i: usize| match i % 7 {
            0 => -0.0,
            1 => 0.0,
            k => ((i * i + 3 * i) as f64).sin() * 10.0_f64.powi(k as i32 - 4),
        };
        let columns = (0..points * groups)
            .map(|i| [0, 1, 2, 3].map(|lane| number(4 * i + lane)))
            .collect();
        let row = |group| {
            core::array::from_fn(|a| [0, 1, 2, 3].map(|lane| number(5 * group + 3 * a + lane)))
        };
        let rows = (0..groups).map(row).collect();
        (Matrix { groups, columns }, rows)
    }

    fn compared<const N: usize, const C: usize>(points: usize) {
        let (matrix, rows) = given::<N>(points);
        let like = Lanes([0.0; 4]);
        let mut products = [[[[f64::NAN; 4]; N]; C]; 2];
        matrix.apply_to::<_, N, C>(like, &[true; N], &rows, &mut products[0]);
        matrix.apply_in_turn(like, &[true; N], &rows, &mut products[1]);
        let [written_out, in_turn] = products.map(|one| one.as_flattened().as_flattened().to_vec());
        for (a, b) in written_out.iter().zip(&in_turn) {
            assert_eq!(a.to_bits(), b.to_bits(), "{points} points: {a} and {b}");
        }
    }

    #[test]
    fn products_by_constant_sizes_are_those_of_any_size() {
        for points in 1..=16_usize {
            match points.div_ceil(4) {
                1 => (compared::<1, 1>(points), compared::<6, 1>(points)),
                2 => (compared::<1, 2>(points), compared::<6, 2>(points)),
                3 => (compared::<1, 3>(points), compared::<6, 3>(points)),
                _ => (compared::<1, 4>(points), compared::<6, 4>(points)),
            };
        }
    }
}
