//! The periodic QR iteration on a Hessenberg–triangular chain.

use super::arithmetic::{Rotation, exponent, largest, reflection, times_power_of_two};
use super::chain::Chain;
use super::error::PeriodicSchurError;

/// The largest number of QR steps on one block; two or three are usual.
const STEPS: u32 = 90;

/// The number of QR steps without result after which an exceptional step is made.
const PATIENCE: u32 = 10;

/// The number of steps without shift that look for a zero eigenvalue hidden in the last factor.
const DOUBTS: u32 = 4;

/// What a step without shift has shown about the last factor.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rank {
    Full,
    /// Nearly singular: the zero may not have reached the last row yet.
    Doubtful,
    /// Singular up to rounding error; the last eigenvalue is zero and split off.
    Deficient,
}

/// A block of rows `first..=last` without negligible subdiagonal entries.
#[derive(Clone, Copy, Debug)]
struct Block {
    first: usize,
    last: usize,
}

/// Some entries of one column of the product, times 2^exponent.
struct Column {
    entries: [f64; 3],
    exponent: i64,
}

impl Chain {
    /// Makes the last factor quasi-triangular; its 2 × 2 blocks belong to complex pairs.
    pub(super) fn iterate(&mut self) -> Result<(), PeriodicSchurError> {
        let mut remaining = self.order();
        let mut iterations = 0;
        // From this row on, the last factor is known to be nonsingular.
        let mut regular_from = remaining;
        while remaining > 0 {
            let last = remaining - 1;
            let block = Block {
                first: self.block_start(last, iterations),
                last,
            };
            let size = last - block.first + 1;
            // Zero eigenvalues must be split off before shifts are useful.
            let singular = size > 1 && (self.clear_zero_diagonal(block) || last < regular_from);
            if size == 1 || (size == 2 && !singular && self.is_complex(block)) {
                remaining -= size;
                iterations = 0;
                continue;
            }
            if iterations == STEPS {
                return Err(PeriodicSchurError::NoConvergence {
                    first: block.first,
                    last,
                    iterations,
                });
            }
            iterations += 1;
            if singular || iterations % (2 * PATIENCE) == PATIENCE {
                regular_from = match self.step_without_shift(block) {
                    // There may be another zero above.
                    Rank::Deficient => last,
                    Rank::Doubtful if iterations < DOUBTS => last + 1,
                    _ => block.first,
                };
            } else if size == 2 {
                self.step_with_one_shift(block);
            } else {
                self.step_with_two_shifts(block, iterations % (2 * PATIENCE) == 0);
            }
        }
        Ok(())
    }

    /// The first row of the block that ends with `last`; a negligible subdiagonal entry above it is set to zero.
    fn block_start(&mut self, last: usize, iterations: u32) -> usize {
        let hessenberg = self.last();
        for row in (1..=last).rev() {
            let entry = self.at(hessenberg, row, row - 1).abs();
            let mut size =
                self.at(hessenberg, row - 1, row - 1).abs() + self.at(hessenberg, row, row).abs();
            if size == 0.0 || iterations > PATIENCE {
                // Relative to its neighbours the entry may not fall below its rounding error, which is relative to the
                // norm.
                size = (0..=last).fold(size, |most, j| {
                    (0..=(j + 1).min(last))
                        .fold(most, |most, i| most.max(self.at(hessenberg, i, j).abs()))
                });
            }
            if entry <= f64::EPSILON * size {
                self.set(hessenberg, row, row - 1, 0.0);
                return row;
            }
        }
        0
    }

    /// The rounding error of zero, relative to the entries above it.
    fn zero_tolerance(&self) -> f64 {
        // The reduction applies about 2 n reflections to each column.
        2.0 * (self.order() + 2) as f64 * f64::EPSILON
    }

    /// The sum of the moduli above a diagonal entry, from row `first` on.
    fn size_above(&self, factor: usize, first: usize, diagonal: usize) -> f64 {
        (first..diagonal)
            .map(|row| self.at(factor, row, diagonal).abs())
            .sum()
    }

    /// Sets diagonal entries of the triangular factors to zero if they are zero up to rounding error; returns whether
    /// there are any.
    fn clear_zero_diagonal(&mut self, block: Block) -> bool {
        let tolerance = self.zero_tolerance();
        let mut any = false;
        for factor in 0..self.last() {
            for j in block.first..=block.last {
                if self.at(factor, j, j).abs()
                    <= tolerance * self.size_above(factor, block.first, j)
                {
                    self.set(factor, j, j, 0.0);
                    any = true;
                }
            }
        }
        any
    }

    /// One QR step without shift.
    ///
    /// Rotations make the last factor triangular and are then passed through the others. A zero on the diagonal of one
    /// of these, in row j, absorbs the rotation of rows j − 1 and j: the block splits above j, and the zero has moved
    /// to the end of its part, where a second step splits it off.
    fn step_without_shift(&mut self, block: Block) -> Rank {
        let Block { first, last } = block;
        let hessenberg = self.last();
        let end = self.reach(first, last).end;
        let mut rotations = Vec::with_capacity(last - first);
        for j in first..last {
            let (rotation, r) =
                Rotation::new(self.at(hessenberg, j, j), self.at(hessenberg, j + 1, j));
            self.rotate_rows(hessenberg, j, rotation, j + 1..end);
            self.set(hessenberg, j, j, r);
            self.set(hessenberg, j + 1, j, 0.0);
            rotations.push(rotation);
        }
        let small = |chain: &Self, row, tolerance| {
            chain.at(hessenberg, row, row).abs()
                <= tolerance * chain.size_above(hessenberg, first, row)
        };
        let rank = if small(self, last, self.zero_tolerance()) {
            self.set(hessenberg, last, last, 0.0);
            Rank::Deficient
        } else if (first..=last).any(|row| small(self, row, f64::EPSILON.sqrt())) {
            Rank::Doubtful
        } else {
            Rank::Full
        };
        self.take_round(block, rotations);
        rank
    }

    /// One QR step with a real shift on a 2 × 2 block.
    fn step_with_one_shift(&mut self, block: Block) {
        let [[a, b], [c, d]] = self.product_of_two(block.first);
        let shift = near_eigenvalue(a, b, c, d).unwrap_or(d);
        let (rotation, _) = Rotation::new(a - shift, c);
        let columns = block.first..self.reach(block.first, block.last).end;
        self.rotate_rows(self.last(), block.first, rotation, columns);
        self.take_round(block, vec![rotation]);
    }

    /// Passes rotations of the rows of the last factor through the triangular factors to its columns.
    fn take_round(&mut self, block: Block, mut rotations: Vec<Rotation>) {
        let reach = self.reach(block.first, block.last);
        for factor in 0..self.last() {
            for (j, rotation) in (block.first..).zip(&mut rotations) {
                self.rotate_columns(factor, j, *rotation, reach.start..j + 2);
                let (next, r) = Rotation::new(self.at(factor, j, j), self.at(factor, j + 1, j));
                self.rotate_rows(factor, j, next, j + 1..reach.end);
                self.set(factor, j, j, r);
                self.set(factor, j + 1, j, 0.0);
                *rotation = next;
            }
        }
        for (j, rotation) in (block.first..).zip(rotations) {
            self.rotate_columns(self.last(), j, rotation, reach.start..j + 2);
        }
    }

    /// One QR step with two shifts, real or conjugate, on a block of at least three rows.
    fn step_with_two_shifts(&mut self, block: Block, out_of_the_ordinary: bool) {
        let Block { first, last } = block;
        let hessenberg = self.last();
        let reach = self.reach(first, last);
        let mut start = self.shifted_column(block, out_of_the_ordinary);
        // The reflection of rows j, … of the last factor passes once through all factors and creates a bulge one column
        // further on.
        for j in first..last {
            let size = (last - j + 1).min(3);
            let v = &mut start[..size];
            let from = if j == first {
                first
            } else {
                for (i, v) in v.iter_mut().enumerate() {
                    *v = self.at(hessenberg, j + i, j - 1);
                }
                j - 1
            };
            let (tau, beta) = reflection(v);
            self.reflect_rows(hessenberg, j, v, tau, from..reach.end);
            if j > first {
                self.finish_column(hessenberg, j, j - 1, beta, size);
            }
            self.reflect_columns(0, j, v, tau, reach.start..self.filled(0, j + size, last));
            for factor in 0..hessenberg {
                for i in 0..size - 1 {
                    let (at, size) = (j + i, size - i);
                    let mut v = [0.0; 3];
                    for (i, v) in v[..size].iter_mut().enumerate() {
                        *v = self.at(factor, at + i, at);
                    }
                    let (tau, beta) = reflection(&mut v[..size]);
                    self.reflect_rows(factor, at, &v[..size], tau, at + 1..reach.end);
                    self.finish_column(factor, at, at, beta, size);
                    let rows = reach.start..self.filled(factor + 1, at + size, last);
                    self.reflect_columns(factor + 1, at, &v[..size], tau, rows);
                }
            }
        }
    }

    /// Writes the image of a reflected vector: β, then zeros.
    fn finish_column(&mut self, factor: usize, row: usize, column: usize, beta: f64, size: usize) {
        self.set(factor, row, column, beta);
        for i in 1..size {
            self.set(factor, row + i, column, 0.0);
        }
    }

    /// The end of the nonzero rows in the columns before `column`, in the block that ends with `last`.
    fn filled(&self, factor: usize, column: usize, last: usize) -> usize {
        if factor == self.last() {
            (column + 1).min(last + 1)
        } else {
            column
        }
    }

    /// A multiple of (P − σ₁)(P − σ₂) e₁, where the shifts σ are estimated at the end of the block.
    ///
    /// Rounding errors in it can only slow down the iteration: for any vector, the step is an orthogonal
    /// transformation.
    fn shifted_column(&self, block: Block, out_of_the_ordinary: bool) -> [f64; 3] {
        let Block { first, last } = block;
        let mut columns = [
            self.column_of_product(first, 2, 0, [0, 1, 2]),
            self.column_of_product(first, 2, 1, [0, 1, 2]),
            self.column_of_product(last - 2, 3, 1, [1, 2, 2]),
            self.column_of_product(last - 2, 3, 2, [1, 2, 2]),
        ];
        to_one_exponent(&mut columns);
        let [[p11, p21, _], [p12, p22, p32], [a, c, _], [b, d, _]] =
            columns.map(|column| column.entries);
        // The shifts are center ± i √square.
        let (center, square) = if out_of_the_ordinary {
            let size = c.abs() + p21.abs();
            (d + 0.75 * size, 0.4375 * size * size)
        } else {
            match near_eigenvalue(a, b, c, d) {
                Ok(shift) => (shift, 0.0),
                Err(discriminant) => (f64::midpoint(a, d), -discriminant),
            }
        };
        // Written with differences, which are exact if P is close to a multiple of the identity.
        let (x, y) = (p11 - center, p22 - center);
        let v = [x * x + square + p12 * p21, p21 * (x + y), p21 * p32];
        // All entries may have underflowed; then any start vector serves.
        if largest(&v) > 0.0 { v } else { [1.0; 3] }
    }

    /// Whether the eigenvalues of a 2 × 2 block are complex.
    fn is_complex(&self, block: Block) -> bool {
        let [[a, b], [c, d]] = self.product_of_two(block.first);
        near_eigenvalue(a, b, c, d).is_err()
    }

    /// A multiple of the 2 × 2 block of the product that starts at this row and is a block by itself.
    fn product_of_two(&self, first: usize) -> [[f64; 2]; 2] {
        let mut columns = [0, 1].map(|column| self.column_of_product(first, 2, column, [0, 1, 1]));
        to_one_exponent(&mut columns);
        let [[a, c, _], [b, d, _]] = columns.map(|column| column.entries);
        [[a, b], [c, d]]
    }

    /// Entries of one column of the product, using only `size` rows and columns of the factors from `first` on.
    ///
    /// `column` and `rows` are counted from `first`; rows beyond the end of the matrix are zero.
    fn column_of_product(
        &self,
        first: usize,
        size: usize,
        column: usize,
        rows: [usize; 3],
    ) -> Column {
        let mut u = [0.0; 3];
        u[column] = 1.0;
        let mut shift = 0;
        for factor in 0..self.last() {
            for i in 0..=column {
                u[i] = (i..=column)
                    .map(|j| self.at(factor, first + i, first + j) * u[j])
                    .sum();
            }
            let most = largest(&u);
            if most > 0.0 && !(1e-6..1e2).contains(&most) {
                let e = exponent(most);
                u = u.map(|u| times_power_of_two(u, -e));
                shift += e;
            }
        }
        let entries = rows.map(|row| {
            if first + row >= self.order() {
                return 0.0;
            }
            (0..size)
                .map(|j| self.at(self.last(), first + row, first + j) * u[j])
                .sum()
        });
        Column {
            entries,
            exponent: shift,
        }
    }
}

/// Scales columns to a common exponent, the largest; entries too small for it become zero.
fn to_one_exponent(columns: &mut [Column]) {
    let size = |column: &Column| {
        let most = largest(&column.entries);
        (most > 0.0).then(|| column.exponent + exponent(most))
    };
    let common = columns.iter().filter_map(size).max().unwrap_or(0);
    for column in columns {
        column.entries = column
            .entries
            .map(|entry| times_power_of_two(entry, column.exponent - common));
        column.exponent = common;
    }
}

/// The eigenvalue of (a b; c d) closest to d if it is real, otherwise the negative square of its imaginary part.
///
/// The moduli of the entries are at most 2.
fn near_eigenvalue(a: f64, b: f64, c: f64, d: f64) -> Result<f64, f64> {
    let half = 0.5 * (a - d);
    let discriminant = half * half + b * c;
    if discriminant < 0.0 {
        return Err(discriminant);
    }
    let denominator = half + discriminant.sqrt().copysign(half);
    Ok(if denominator == 0.0 {
        d
    } else {
        d - b * c / denominator
    })
}
