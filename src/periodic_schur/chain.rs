//! The factors under transformation: scaling, balancing, reduction to Hessenberg–triangular form.

use super::arithmetic::{
    Rotation, Scaled, exponent, largest, reflect_columns, reflect_rows, reflection,
    size_in_all_units, times_power_of_two,
};
use super::error::PeriodicSchurError;
use nalgebra::{Complex, DMatrix};
use std::ops::Range;

/// One matrix for each factor or node.
type Matrices = Vec<DMatrix<f64>>;

/// What the transformations are applied to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wanted {
    /// Eigenvalues only: factors are balanced, there are no bases, and each block is transformed separately.
    Multipliers,
    /// The bases and the complete triangular factors.
    SchurForm,
}

/// The factors T_k = Q_{k+1}ᵀ A_k Q_k during the reduction to triangular form; node k is the space between T_{k−1} and
/// T_k.
pub(super) struct Chain {
    order: usize,
    /// At least one, each order × order and finite.
    factors: Matrices,
    /// Factor k is `factors[k]` · 2^`exponents[k]`.
    exponents: Vec<i64>,
    /// Q_k for each node, if wanted.
    bases: Option<Matrices>,
}

impl Chain {
    /// Checks and scales the factors.
    pub(super) fn new(mut factors: Matrices, wanted: Wanted) -> Result<Self, PeriodicSchurError> {
        let order = factors.first().ok_or(PeriodicSchurError::Empty)?.nrows();
        for (index, factor) in factors.iter().enumerate() {
            let (rows, columns) = factor.shape();
            if rows != columns {
                return Err(PeriodicSchurError::NotSquare {
                    index,
                    rows,
                    columns,
                });
            }
            if rows != order {
                return Err(PeriodicSchurError::SizeMismatch {
                    index,
                    found: rows,
                    expected: order,
                });
            }
            if factor.iter().any(|x| !x.is_finite()) {
                return Err(PeriodicSchurError::NonFinite { index });
            }
        }
        let exponents = factors.iter_mut().map(keep_from_overflow).collect();
        let bases = match wanted {
            Wanted::Multipliers => {
                balance(&mut factors, order);
                None
            }
            Wanted::SchurForm => Some(vec![DMatrix::identity(order, order); factors.len()]),
        };
        Ok(Self {
            order,
            factors,
            exponents,
            bases,
        })
    }

    /// The bases and the factors.
    pub(super) fn into_parts(mut self) -> Result<(Matrices, Matrices), PeriodicSchurError> {
        for (index, (factor, &exponent)) in self.factors.iter_mut().zip(&self.exponents).enumerate()
        {
            for x in factor.iter_mut() {
                *x = times_power_of_two(*x, exponent);
                if !x.is_finite() {
                    return Err(PeriodicSchurError::NonFinite { index });
                }
            }
        }
        Ok((self.bases.unwrap_or_default(), self.factors))
    }

    /// The number of rows of each factor.
    pub(super) fn order(&self) -> usize {
        self.order
    }

    /// The index of the last factor, the one that is Hessenberg; also the number of triangular factors.
    pub(super) fn last(&self) -> usize {
        self.factors.len() - 1
    }

    /// An entry of a factor.
    pub(super) fn at(&self, factor: usize, row: usize, column: usize) -> f64 {
        self.factors[factor][(row, column)]
    }

    /// Sets an entry of a factor.
    pub(super) fn set(&mut self, factor: usize, row: usize, column: usize, value: f64) {
        self.factors[factor][(row, column)] = value;
    }

    /// Whether a diagonal block ends with this row.
    pub(super) fn splits_after(&self, row: usize) -> bool {
        row + 1 >= self.order || self.at(self.last(), row + 1, row) == 0.0
    }

    /// The sum of the exponents taken out of the factors.
    pub(super) fn exponent(&self) -> i64 {
        self.exponents.iter().sum()
    }

    /// The product of the diagonal entries in one row.
    pub(super) fn diagonal_product(&self, row: usize) -> Scaled {
        let mut product = Scaled::ONE;
        for factor in &self.factors {
            product.multiply(Complex::new(factor[(row, row)], 0.0));
        }
        product.exponent += self.exponent();
        product
    }

    /// The rows and columns to which a transformation of the block `first..=last` is applied.
    pub(super) fn reach(&self, first: usize, last: usize) -> Range<usize> {
        if self.bases.is_some() {
            0..self.order
        } else {
            first..last + 1
        }
    }

    /// Reflects rows of a factor, from `row` on.
    pub(super) fn reflect_rows(
        &mut self,
        factor: usize,
        row: usize,
        v: &[f64],
        tau: f64,
        columns: Range<usize>,
    ) {
        if tau != 0.0 {
            reflect_rows(
                self.factors[factor].as_mut_slice(),
                self.order,
                row,
                v,
                tau,
                columns,
            );
        }
    }

    /// Reflects columns of a factor, from `column` on, and the basis of their node.
    pub(super) fn reflect_columns(
        &mut self,
        factor: usize,
        column: usize,
        v: &[f64],
        tau: f64,
        rows: Range<usize>,
    ) {
        if tau != 0.0 {
            reflect_columns(
                self.factors[factor].as_mut_slice(),
                self.order,
                column,
                v,
                tau,
                rows,
            );
            if let Some(bases) = &mut self.bases {
                reflect_columns(
                    bases[factor].as_mut_slice(),
                    self.order,
                    column,
                    v,
                    tau,
                    0..self.order,
                );
            }
        }
    }

    /// Rotates two rows of a factor.
    pub(super) fn rotate_rows(
        &mut self,
        factor: usize,
        row: usize,
        rotation: Rotation,
        columns: Range<usize>,
    ) {
        rotation.rows(
            self.factors[factor].as_mut_slice(),
            self.order,
            row,
            columns,
        );
    }

    /// Rotates two columns of a factor, and the basis of their node.
    pub(super) fn rotate_columns(
        &mut self,
        factor: usize,
        column: usize,
        rotation: Rotation,
        rows: Range<usize>,
    ) {
        rotation.columns(
            self.factors[factor].as_mut_slice(),
            self.order,
            column,
            rows,
        );
        if let Some(bases) = &mut self.bases {
            rotation.columns(
                bases[factor].as_mut_slice(),
                self.order,
                column,
                0..self.order,
            );
        }
    }

    /// Reduces the last factor to Hessenberg form and the others to triangular form.
    ///
    /// Column j is cleared in all factors, in the order of multiplication, before column j + 1. The reflection that
    /// clears it in one factor also acts on the columns from j on of the next factor; the one of the last factor does
    /// not affect column j.
    pub(super) fn reduce(&mut self) {
        let n = self.order;
        let last = self.last();
        let mut v = vec![0.0; n];
        for j in 0..n.saturating_sub(1) {
            for k in 0..=last {
                let from = if k == last { j + 1 } else { j };
                let next = if k == last { 0 } else { k + 1 };
                let v = &mut v[from..];
                v.copy_from_slice(&self.factors[k].as_slice()[j * n + from..(j + 1) * n]);
                let (tau, beta) = reflection(v);
                self.reflect_rows(k, from, v, tau, j + 1..n);
                let column = &mut self.factors[k].as_mut_slice()[j * n + from..(j + 1) * n];
                column.fill(0.0);
                column[0] = beta;
                self.reflect_columns(next, from, v, tau, 0..n);
            }
        }
    }
}

/// Scales a factor by 2^−e if its largest entry could overflow or underflow in sums; returns e.
///
/// No other scaling is applied: in a factor with entries of very different size the small ones would be lost.
fn keep_from_overflow(factor: &mut DMatrix<f64>) -> i64 {
    let size = largest(factor.iter());
    let shift = match exponent(size) {
        _ if size == 0.0 => 0,
        e if e > 1000 => e - 1000,
        e if e < -500 => e,
        _ => 0,
    };
    if shift != 0 {
        factor.apply(|x| *x = times_power_of_two(*x, -shift));
    }
    shift
}

/// Scales rows and columns of all factors by one diagonal similarity A_k → D⁻¹ A_k D of powers of two.
///
/// The units of coordinates and momenta may make one a billion times the other; balancing (Parlett and Reinsch) removes
/// this ratio from the factors and from the rounding errors.
fn balance(factors: &mut [DMatrix<f64>], n: usize) {
    let is_lost = |factor: &DMatrix<f64>| {
        let size = largest(factor.iter());
        let mut entries = factor.iter();
        entries.any(|x| *x != 0.0 && x.abs() / size < f64::MIN_POSITIVE)
    };
    if factors.iter().any(is_lost) {
        // First unscaled, so that no entry counts as zero.
        balance_by(factors, n, |_| 1.0);
    }
    // Then with each factor relative to its largest entry.
    balance_by(factors, n, |factor| largest(factor.iter()));
}

/// Balances by the largest modulus of each entry, relative to the sizes of the factors.
fn balance_by(factors: &mut [DMatrix<f64>], n: usize, size_of: impl Fn(&DMatrix<f64>) -> f64) {
    let mut most = DMatrix::<f64>::zeros(n, n);
    for factor in factors.iter() {
        let size = size_of(factor);
        if size > 0.0 {
            most.zip_apply(factor, |most, x| *most = most.max(x.abs() / size));
        }
    }
    let mut scales = vec![0i64; n];
    balancing(most.as_mut_slice(), 0.0, &mut scales);
    if scales.iter().any(|&scale| scale != scales[0]) {
        for factor in factors {
            for i in 0..n {
                for j in 0..n {
                    factor[(i, j)] = times_power_of_two(factor[(i, j)], scales[j] - scales[i]);
                }
            }
        }
    }
}

/// Finds exponents s for which 2^−s_i · `most`_ij · 2^s_j is balanced, and applies this similarity to `most`.
///
/// `most` contains moduli, n × n, column-major; for a row-major matrix the exponents have the opposite sign. The sums
/// of each row and of the column of the same index are balanced, without the diagonal and with `floor` added, so that
/// entries small relative to `floor` are left alone. Without a floor, a row or a column without a counterpart, as that
/// of a free coordinate or a conserved momentum, is made no larger than [`size_in_all_units`].
pub(crate) fn balancing(most: &mut [f64], floor: f64, exponents: &mut [i64]) {
    let n = exponents.len();
    let size = size_in_all_units(most, n);
    exponents.fill(0);
    // Each pass at least halves the remaining exponents; a dozen passes cover the range of `f64`.
    for _ in 0..24 {
        let mut changed = false;
        for i in 0..n {
            let others = || (0..n).filter(|&j| j != i);
            let column = floor + others().map(|j| most[j + i * n]).sum::<f64>();
            let row = floor + others().map(|j| most[i + j * n]).sum::<f64>();
            let beyond = |sum: f64| (exponent(sum) - exponent(size)).max(0);
            let e = match (row > 0.0, column > 0.0) {
                (true, true) => (exponent(row) - exponent(column)) / 2,
                (true, false) if size > 0.0 => beyond(row),
                (false, true) if size > 0.0 => -beyond(column),
                _ => continue,
            };
            let after = times_power_of_two(column, e) + times_power_of_two(row, -e);
            if e == 0 || after >= 0.95 * (column + row) {
                continue;
            }
            for j in others() {
                most[j + i * n] = times_power_of_two(most[j + i * n], e);
                most[i + j * n] = times_power_of_two(most[i + j * n], -e);
            }
            exponents[i] += e;
            changed = true;
        }
        if !changed {
            break;
        }
    }
}
