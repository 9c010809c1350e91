//! The real Schur form of a matrix with its largest eigenvalues first.

use super::eigenvalues::eigenvalues_of_two;
use crate::periodic_schur::{PeriodicSchur, PeriodicSchurError};
use nalgebra::{Complex, DMatrix};

/// The decomposition H Z = Z T: Z is orthogonal, T upper triangular except for diagonal blocks of two rows.
pub(super) struct Ordered {
    vectors: DMatrix<f64>,
    triangular: DMatrix<f64>,
    /// The sizes of the diagonal blocks.
    blocks: Vec<usize>,
    /// The number of leading columns that are in order.
    kept: usize,
}

impl Ordered {
    /// The Schur form in any order.
    pub(super) fn new(matrix: DMatrix<f64>) -> Result<Self, PeriodicSchurError> {
        let schur = PeriodicSchur::new(&[matrix])?;
        let vectors = schur.orthogonal()[0].clone();
        let triangular = schur.triangular()[0].clone();
        let (mut blocks, mut row) = (Vec::new(), 0);
        while row < triangular.nrows() {
            let pair = row + 1 < triangular.nrows() && triangular[(row + 1, row)] != 0.0;
            blocks.push(if pair { 2 } else { 1 });
            row += blocks[blocks.len() - 1];
        }
        Ok(Self {
            vectors,
            triangular,
            blocks,
            kept: 0,
        })
    }

    /// Moves the largest eigenvalues to the front until at least `wanted` columns, or all, are in order.
    pub(super) fn lead(&mut self, wanted: usize) {
        let mut leading = 0;
        while self.kept < wanted && leading < self.blocks.len() {
            let mut place = leading;
            let mut row = self.kept;
            let mut largest = -1.0;
            for (k, size) in self.blocks.iter().enumerate().skip(leading) {
                let modulus = largest_of(&self.triangular, row, *size).norm();
                if modulus > largest {
                    (place, largest) = (k, modulus);
                }
                row += size;
            }
            while place > leading {
                self.swap(place - 1);
                place -= 1;
            }
            self.kept += self.blocks[leading];
            leading += 1;
        }
    }

    /// Exchanges block k and the next one.
    ///
    /// With T₁₁X − XT₂₂ = T₁₂ the columns of (−X, 1) span the space of T₂₂.
    fn swap(&mut self, k: usize) {
        let first: usize = self.blocks[..k].iter().sum();
        let (p, q) = (self.blocks[k], self.blocks[k + 1]);
        let (second, both) = (first + p, p + q);
        let t = &self.triangular;
        let sylvester = DMatrix::from_fn(p * q, p * q, |row, column| {
            let ((i, j), (r, s)) = ((row % p, row / p), (column % p, column / p));
            let left = if j == s {
                t[(first + i, first + r)]
            } else {
                0.0
            };
            let right = if i == r {
                t[(second + s, second + j)]
            } else {
                0.0
            };
            left - right
        });
        let right = DMatrix::from_fn(p * q, 1, |row, _| t[(first + row % p, second + row / p)]);
        // Equal eigenvalues need no exchange. If they are equal up to rounding error, X is infinite or very large, and
        // (−X, 1) spans the space of T₁₁.
        let Some(x) = sylvester
            .lu()
            .solve(&right)
            .filter(|x| x.iter().all(|entry| entry.is_finite()))
        else {
            return;
        };
        let space = DMatrix::from_fn(both, both, |row, column| match (row < p, column < q) {
            (true, true) => -x[column * p + row],
            (false, true) => f64::from(u8::from(row - p == column)),
            (true, false) => f64::from(u8::from(row == column - q)),
            (false, false) => 0.0,
        });
        let turn = space.qr().q();
        let rows = self.triangular.rows(first, both).into_owned();
        self.triangular
            .rows_mut(first, both)
            .copy_from(&turn.tr_mul(&rows));
        for matrix in [&mut self.triangular, &mut self.vectors] {
            let columns = matrix.columns(first, both).into_owned();
            matrix
                .columns_mut(first, both)
                .copy_from(&(columns * &turn));
        }
        self.triangular
            .view_mut((first + q, first), (p, q))
            .fill(0.0);
        self.blocks.swap(k, k + 1);
    }

    /// The first eigenvalue.
    pub(super) fn leading(&self) -> Complex<f64> {
        largest_of(&self.triangular, 0, self.block(0))
    }

    /// The number of rows of a diagonal block; zero beyond the last one.
    pub(super) fn block(&self, k: usize) -> usize {
        self.blocks.get(k).copied().unwrap_or(0)
    }

    /// The number of leading columns that are in order.
    pub(super) fn kept(&self) -> usize {
        self.kept
    }

    /// The orthogonal matrix Z.
    pub(super) fn vectors(&self) -> &DMatrix<f64> {
        &self.vectors
    }

    /// The block triangular matrix T.
    pub(super) fn triangular(&self) -> &DMatrix<f64> {
        &self.triangular
    }
}

/// The eigenvalue of larger modulus of a diagonal block of one or two rows.
pub(super) fn largest_of(block: &DMatrix<f64>, first: usize, rows: usize) -> Complex<f64> {
    if rows == 1 {
        return Complex::new(block[(first, first)], 0.0);
    }
    let entry = |i: usize, j: usize| block[(first + i, first + j)];
    let [one, other] = eigenvalues_of_two([[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]);
    if other.norm() > one.norm() {
        other
    } else {
        one
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_come_first() {
        let size = 12;
        let matrix = DMatrix::from_fn(size, size, |row, column| {
            ((3 * row + 7 * column * column) as f64).sin()
        });
        let mut ordered = Ordered::new(matrix.clone()).expect("a Schur form");
        ordered.lead(size);
        let (z, t) = (ordered.vectors(), ordered.triangular());
        let rest = &matrix * z - z * t;
        assert!(rest.amax() < 1e-13, "{:e}", rest.amax());
        assert!((z.tr_mul(z) - DMatrix::identity(size, size)).amax() < 1e-14);
        let (mut row, mut last) = (0, f64::INFINITY);
        for k in 0..ordered.blocks.len() {
            let modulus = largest_of(t, row, ordered.block(k)).norm();
            assert!(modulus <= last * (1.0 + 1e-12), "{modulus} after {last}");
            (row, last) = (row + ordered.block(k), modulus);
        }
        assert_eq!(row, size);
        for column in 0..size {
            for below in column + 2..size {
                assert_eq!(t[(below, column)], 0.0);
            }
        }
    }
}
