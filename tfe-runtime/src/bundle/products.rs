//! Products of the tables with numbers of eight trajectories.

use super::group::Row;
use super::pair::Eight;
use crate::points::four::Apart;
use crate::points::tables::{Matrix, Weights};

/// The product of a K × K matrix with a vector over the points, for every coordinate.
#[inline(always)]
pub(super) fn apply<V: Eight, const N: usize>(
    like: V,
    matrix: &Matrix,
    rows: &[Row<N>],
    products: &mut [Row<N>],
) {
    like.apart(Product {
        like,
        matrix,
        rows,
        products,
    });
}

/// A product to be computed. No model is part of its type, so that all places of its call share what the compiler makes of it.
struct Product<'a, V, const N: usize> {
    like: V,
    matrix: &'a Matrix,
    rows: &'a [Row<N>],
    products: &'a mut [Row<N>],
}

impl<V: Eight, const N: usize> Apart for Product<'_, V, N> {
    #[inline(always)]
    fn run(self) {
        // Small tables are written out; as many lines at once as their sums fit into registers.
        match self.rows.len() {
            1 => self.lines::<1, 1, 0, 1>(),
            2 => self.lines::<2, 1, 0, 2>(),
            3 => self.lines::<3, 1, 0, 3>(),
            4 => self.lines::<4, 1, 0, 4>(),
            5 => self.lines::<5, 2, 0, 5>(),
            6 => self.lines::<6, 2, 0, 6>(),
            7 => self.lines::<7, 2, 0, 4>().lines::<7, 2, 4, 3>(),
            8 => self.lines::<8, 2, 0, 4>().lines::<8, 2, 4, 4>(),
            _ => self.any(),
        };
    }
}

impl<V: Eight, const N: usize> Product<'_, V, N> {
    /// Lines `FROM` and B − 1 that follow of a table of K points in C groups.
    #[inline(always)]
    fn lines<const K: usize, const C: usize, const FROM: usize, const B: usize>(self) -> Self {
        let Self { like, .. } = self;
        let (columns, _) = self.matrix.groups().as_chunks::<C>();
        if let (Some(columns), Some(rows), Some(products)) = (
            columns.first_chunk::<K>(),
            self.rows.first_chunk::<K>(),
            self.products[FROM..].first_chunk_mut::<B>(),
        ) {
            for a in 0..N {
                let first = like.with(rows[0][a]);
                let mut sums = [first; B];
                for line in 0..B {
                    sums[line] = like.like(columns[0].as_flattened()[FROM + line]) * first;
                }
                for j in 1..K {
                    let (column, value) = (columns[j].as_flattened(), like.with(rows[j][a]));
                    for line in 0..B {
                        sums[line] += like.like(column[FROM + line]) * value;
                    }
                }
                for line in 0..B {
                    products[line][a] = sums[line].lanes();
                }
            }
        }
        self
    }

    /// Four lines at a time, the rest one by one.
    #[inline(always)]
    fn any(self) -> Self {
        let lines = self.products.len();
        for from in (0..lines / 4 * 4).step_by(4) {
            self.block::<4>(from);
        }
        for from in lines / 4 * 4..lines {
            self.block::<1>(from);
        }
        self
    }
