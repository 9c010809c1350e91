//! Products of the tables with values of eight trajectories.

use super::group::Row;
use crate::precise::{add_exactly, exact_term};
use crate::registers::pair::{Eight, OutOfLine};
use crate::registers::storage::{Heap, Matrix, Weights};

/// The product of a K × K matrix with a vector over the points, for every coordinate that is requested.
#[inline(always)]
pub(super) fn apply<V: Eight, const N: usize>(
    like: V,
    matrix: &Matrix<Heap>,
    wanted: &[bool; N],
    rows: &[Row<N>],
    products: &mut [Row<N>],
) {
    like.out_of_line(Product {
        matrix,
        wanted,
        rows,
        products,
    });
}

/// A product to be computed. Its type does not depend on the model, so that all callers share the compiled code.
struct Product<'a, const N: usize> {
    matrix: &'a Matrix<Heap>,
    wanted: &'a [bool; N],
    rows: &'a [Row<N>],
    products: &'a mut [Row<N>],
}

impl<const N: usize> OutOfLine for Product<'_, N> {
    #[inline(always)]
    fn run<V: Eight>(mut self, like: V) {
        // Products with small tables are unrolled, with as many rows at once as their sums fit into registers.
        match self.rows.len() {
            1 => self.lines::<V, 1, 1, 0, 1>(like),
            2 => self.lines::<V, 2, 1, 0, 2>(like),
            3 => self.lines::<V, 3, 1, 0, 3>(like),
            4 => self.lines::<V, 4, 1, 0, 4>(like),
            5 => self.lines::<V, 5, 2, 0, 5>(like),
            6 => self.lines::<V, 6, 2, 0, 6>(like),
            7 => {
                self.lines::<V, 7, 2, 0, 4>(like);
                self.lines::<V, 7, 2, 4, 3>(like);
            }
            8 => {
                self.lines::<V, 8, 2, 0, 4>(like);
                self.lines::<V, 8, 2, 4, 4>(like);
            }
            count => {
                let whole = count - count % 4;
                for from in (0..whole).step_by(4) {
                    self.block::<V, 4>(like, from);
                }
                for line in whole..count {
                    self.block::<V, 1>(like, line);
                }
            }
        }
    }
}

impl<const N: usize> Product<'_, N> {
    /// Row `FROM` and the B − 1 following rows, of a table of K points in C groups.
    #[inline(always)]
    fn lines<V: Eight, const K: usize, const C: usize, const FROM: usize, const B: usize>(
        &mut self,
        like: V,
    ) {
        let columns = self.matrix.groups().as_chunks::<C>().0;
        let (Some(columns), Some(rows), Some(products)) = (
            columns.first_chunk::<K>(),
            self.rows.first_chunk::<K>(),
            self.products[FROM..].first_chunk_mut::<B>(),
        ) else {
            return;
        };
        for a in 0..N {
            if !self.wanted[a] {
                continue;
            }
            let mut sums = [like; B];
            for j in 0..K {
                let (column, value) = (columns[j].as_flattened(), like.with(rows[j][a]));
                for line in 0..B {
                    let entry = like.like(column[FROM + line]);
                    sums[line] = if j == 0 {
                        entry * value
                    } else {
                        entry.times_plus(value, sums[line])
                    };
                }
            }
            for line in 0..B {
                products[line][a] = sums[line].lanes();
            }
        }
    }

    /// The same for a table of any size.
    #[inline(always)]
    fn block<V: Eight, const B: usize>(&mut self, like: V, from: usize) {
        for a in 0..N {
            if !self.wanted[a] {
                continue;
            }
            let mut sums = [like.like(0.0); B];
            for (column, row) in self.matrix.columns().zip(self.rows) {
                let (column, value) = (&column[from..from + B], like.with(row[a]));
                for line in 0..B {
                    sums[line] = like.like(column[line]).times_plus(value, sums[line]);
                }
            }
            for line in 0..B {
                self.products[from + line][a] = sums[line].lanes();
            }
        }
    }
}

/// Σ weight · value over the points of coordinate `a`, and its rounding error, as in [`Weights::sums`].
#[inline(always)]
pub(super) fn sum<V: Eight, const N: usize, const EXACT: bool>(
    like: V,
    weights: &Weights<Heap>,
    rows: &[Row<N>],
    a: usize,
) -> (V, V) {
    let mut sum = (like.like(0.0), like.like(0.0));
    for (l, row) in rows.iter().enumerate() {
        let (weight, weight_low) = weights.of(l);
        let (weight, value) = (like.like(weight), like.with(row[a]));
        if const { !EXACT } {
            sum.0 = weight.times_plus(value, sum.0);
            continue;
        }
        let term = exact_term((weight, like.like(weight_low)), value);
        add_exactly(&mut sum, term);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lanes;
    use crate::element::Element;
    use crate::points::tables::Tables;
    use crate::registers::pair::{LANES, Pair};
    use crate::scheme::{SchemeTable, Tables as _};

    /// Tables of all sizes, against sums written down.
    #[test]
    fn products_are_sums_over_the_points() {
        let like = Lanes([0.0; 4]);
        for nodes in 2..=12 {
            let scheme = SchemeTable::new(Element::radau(nodes)).unwrap();
            let tables = Tables::of(&scheme.view());
            let points = tables.points;
            let value = |l: usize, a: usize, lane: usize| (l * 31 + a * 7 + lane) as f64 % 10.0;
            let mut rows = vec![[[0.0; LANES]; 3]; points];
            for (l, row) in rows.iter_mut().enumerate() {
                for (a, lanes) in row.iter_mut().enumerate() {
                    for (lane, number) in lanes.iter_mut().enumerate() {
                        *number = value(l, a, lane);
                    }
                }
            }
            let mut products = rows.clone();
            apply(
                Pair(like, like),
                &tables.once,
                &[true; 3],
                &rows,
                &mut products,
            );
            for l in 0..points {
                for a in 0..3 {
                    for lane in 0..LANES {
                        let entries = scheme.view().position[l * points..].iter();
                        let terms = entries.zip(0..points).map(|(x, j)| x * value(j, a, lane));
                        let error = products[l][a][lane] - terms.sum::<f64>();
                        // Roundings of sums below ten times the number of points.
                        assert!(
                            error.abs() <= 1e-14 * points as f64,
                            "{nodes} nodes: {error:.1e}"
                        );
                    }
                }
            }
        }
    }
}
