//! A sparse matrix of small dense blocks: its pattern is fixed, its elimination ordering is computed once, and it is
//! factored on request.

use crate::error::StepError;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use faer::linalg::solvers::Solve as _;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};

/// The place of a block: its entry (i, j) is the value number `first + j · stride + i`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) first: usize,
    pub(super) stride: usize,
}

/// A square matrix of b × b blocks, by columns. The unknowns of one block are next to each other.
#[derive(Clone)]
pub(super) struct Blocked {
    block: usize,
    /// (column, row) of the blocks, sorted.
    pairs: Vec<(usize, usize)>,
    /// Where the blocks of each column begin.
    starts: Vec<usize>,
    structure: SymbolicSparseColMat<usize>,
    symbolic: SymbolicLu<usize>,
    pub(super) values: Vec<f64>,
    factors: Option<Lu<usize, f64>>,
    /// The first of the rows of constraints.
    border: usize,
    /// Their factor in the matrix that is factored: see [`weight_of_rows`].
    weight: f64,
}

impl fmt::Debug for Blocked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Blocked")
            .field("unknowns", &self.size())
            .field("entries", &self.values.len())
            .finish_non_exhaustive()
    }
}

impl Blocked {
    /// A matrix with `count` rows of blocks of size `block`, at the given (row, column); `None` where memory does not
    /// suffice for the ordering.
    pub(super) fn new(count: usize, block: usize, places: &[(usize, usize)]) -> Option<Self> {
        let mut pairs: Vec<(usize, usize)> =
            places.iter().map(|(row, column)| (*column, *row)).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let starts: Vec<usize> = (0..=count)
            .map(|column| pairs.partition_point(|(other, _)| *other < column))
            .collect();
        let mut column_starts = Vec::with_capacity(count * block + 1);
        column_starts.push(0);
        let mut rows = Vec::with_capacity(pairs.len() * block * block);
        for column in 0..count {
            for _ in 0..block {
                for (_, row) in &pairs[starts[column]..starts[column + 1]] {
                    rows.extend(row * block..(row + 1) * block);
                }
                column_starts.push(rows.len());
            }
        }
        let (entries, size) = (rows.len(), count * block);
        let structure = SymbolicSparseColMat::new_checked(size, size, column_starts, None, rows);
        let symbolic = SymbolicLu::try_new(structure.as_ref()).ok()?;
        Some(Self {
            block,
            pairs,
            starts,
            structure,
            symbolic,
            values: vec![0.0; entries],
            factors: None,
            border: count * block,
            weight: 1.0,
        })
    }

    /// The same, whose blocks from this one on are constraints.
    pub(super) fn bordered(mut self, first: usize) -> Self {
        self.border = first * self.block;
        self
    }

    /// The number of unknowns.
    pub(super) fn size(&self) -> usize {
        self.structure.ncols()
    }

    /// The place of the block of a row and a column, which must be one of those given at construction.
    pub(super) fn place(&self, row: usize, column: usize) -> Place {
        let at = self.pairs.binary_search(&(column, row)).unwrap_or(0);
        let (start, end) = (self.starts[column], self.starts[column + 1]);
        let block = self.block;
        Place {
            first: (start * block + (at - start)) * block,
            stride: (end - start) * block,
        }
    }

    /// Whether the matrix has been factored.
    pub(super) fn is_factored(&self) -> bool {
        self.factors.is_some()
    }

    /// Declares the factors out of date.
    pub(super) fn forget(&mut self) {
        self.factors = None;
    }

    /// Factors the matrix.
    ///
    /// # Errors
    /// [`StepError::NonFinite`], [`StepError::SingularTangent`]; the latter names unknown 0, because the factorisation
    /// does not tell where it stopped.
    pub(super) fn factor(&mut self) -> Result<(), StepError> {
        self.factors = None;
        if !self.values.iter().all(|value| value.is_finite()) {
            return Err(StepError::NonFinite);
        }
        self.weight = self.weight_of_border();
        let weighted = (self.weight != 1.0).then(|| {
            let rows = self.structure.row_idx().iter().zip(&self.values);
            let weighted = rows.map(|(row, value)| self.weight_of(*row) * value);
            weighted.collect::<Vec<f64>>()
        });
        let values = weighted.as_deref().unwrap_or(&self.values);
        let matrix = SparseColMatRef::new(self.structure.as_ref(), values);
        let factors = Lu::try_new_with_symbolic(self.symbolic.clone(), matrix);
        self.factors = Some(factors.map_err(|_| StepError::SingularTangent { unknown: 0 })?);
        Ok(())
    }

    /// The weight of the rows of constraints beside the inertias in the same columns.
    fn weight_of_border(&self) -> f64 {
        let mut least = f64::INFINITY;
        for column in 0..self.border {
            let (mut inertia, mut entry) = (0.0_f64, 0.0_f64);
            for at in self.structure.col_range(column) {
                let size = self.values[at].abs();
                if self.structure.row_idx()[at] < self.border {
                    inertia = inertia.max(size);
                } else {
                    entry = entry.max(size);
                }
            }
            least = least.min(ratio(inertia, entry));
        }
        weight_of_rows(least)
    }

    fn weight_of(&self, row: usize) -> f64 {
        if row < self.border { 1.0 } else { self.weight }
    }

    /// Multiplies the entries of the constraints by their weight.
    fn weigh(&self, vector: &mut [f64]) {
        if self.weight != 1.0 {
            for entry in &mut vector[self.border..] {
                *entry *= self.weight;
            }
        }
    }

    /// Replaces a right-hand side by the solution; without factors it is unchanged. A numerically singular matrix gives
    /// a result that is not finite.
    pub(super) fn solve(&self, vector: &mut [f64]) {
        if let Some(factors) = &self.factors {
            self.weigh(vector);
            factors.solve_in_place(faer::ColMut::from_slice_mut(vector).as_mat_mut());
        }
    }

    /// The same with the transposed matrix.
    pub(super) fn solve_transposed(&self, vector: &mut [f64]) {
        if let Some(factors) = &self.factors {
            factors.solve_transpose_in_place(faer::ColMut::from_slice_mut(vector).as_mat_mut());
            self.weigh(vector);
        }
    }
}

/// Ratios of inertias to entries of constraints that need no weight.
const ALIKE: core::ops::RangeInclusive<f64> = 1e-8..=1e8;

/// The weight with which rows of constraints have entries of the size of the inertias, a power of two, from the least
/// [`ratio`] of these; one where they are of similar sizes.
///
/// Elimination subtracts rows of constraints from each other. The rounding errors of what should be zero then must not
/// be chosen as pivots in the place of inertias: lengths of micrometres and masses of 1e-15 kg make moments of inertia
/// of 1e-27 kg m² beside rows of the size of one. If columns of multipliers are eliminated first, the same holds for
/// rows of inertias beside constraints.
fn weight_of_rows(least: f64) -> f64 {
    if ALIKE.contains(&least) || !least.is_finite() {
        return 1.0;
    }
    // Sizes at which there is room for residuals and increments.
    f64::from_bits(least.clamp(1e-200, 1e200).to_bits() & f64::INFINITY.to_bits())
}

/// The ratio of an inertia to an entry of a row of a constraint in the same column; infinite if one of them is zero:
/// a coordinate without inertia has no size to compare with.
fn ratio(inertia: f64, entry: f64) -> f64 {
    if inertia == 0.0 || entry == 0.0 {
        return f64::INFINITY;
    }
    (inertia / entry).abs()
}
