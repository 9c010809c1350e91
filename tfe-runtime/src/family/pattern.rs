//! Sparsity patterns of second derivatives of models of run-time length: the places are found once, the values are
//! computed each time.

use super::model::{Block, Entries, Gradient, Model};
use crate::model::NO_TIME;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::AddAssign;

/// The places of second derivatives that can be non-zero, sorted by block, column and row.
///
/// They are recorded in one run of the kernel: the entries to which it adds, and their order, depend on lengths alone.
/// Later runs scatter their values by this record.
///
/// ```text
/// (block, row, column)     one for each place, and for each contribution of the kernel the number of its place
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pattern {
    places: Vec<(Block, usize, usize)>,
    /// The place of each contribution, in the order of the kernel.
    contributions: Vec<usize>,
}

/// Records places.
struct Recorder(Vec<(Block, usize, usize)>);

impl Entries<f64> for Recorder {
    fn add(&mut self, block: Block, row: usize, column: usize, _: f64) {
        self.0.push((block, row, column));
    }
}

/// Adds values to the places of a [`Pattern`].
#[derive(Debug)]
pub struct Values<'a, R = f64> {
    contributions: core::slice::Iter<'a, usize>,
    values: &'a mut [R],
}

impl<R: AddAssign> Entries<R> for Values<'_, R> {
    #[inline]
    fn add(&mut self, _: Block, _: usize, _: usize, value: R) {
        // If the lengths of the model have changed since the recording, contributions beyond the recorded ones are
        // dropped.
        if let Some(place) = self.contributions.next()
            && let Some(entry) = self.values.get_mut(*place)
        {
            *entry += value;
        }
    }
}

impl Pattern {
    /// The pattern of all second derivatives of a model that has been [checked](Model::check).
    ///
    /// Memory and time are linear in the number of contributions.
    pub fn of<M: Model>(model: &M) -> Self {
        let n = model.len();
        let (mut z, mut q, mut force) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let first = Gradient {
            z: &mut z,
            q: &mut q,
            force: &mut force,
        };
        let zero = vec![0.0; n];
        Self::recorded(|recorder| model.second(NO_TIME, &zero, &zero, first, recorder))
    }

    /// The pattern of ∂²/∂z∂z alone.
    #[cfg(feature = "sparse")]
    pub(super) fn of_mass<M: Model>(model: &M) -> Self {
        let zero = vec![0.0; model.len()];
        Self::recorded(|recorder| model.mass(NO_TIME, &zero, &zero, recorder))
    }

    /// The pattern of the rows of constraints.
    #[cfg(feature = "sparse")]
    pub(super) fn of_rows<M: Model>(model: &M) -> Self {
        let (zero, mut drift) = (vec![0.0; model.len()], vec![0.0; model.constraints()]);
        Self::recorded(|recorder| model.constraint_rows(0.0, &zero, &mut drift, recorder))
    }

    /// The pattern of the second derivatives of constraints.
    #[cfg(feature = "sparse")]
    pub(super) fn of_bends<M: Model>(model: &M) -> Self {
        let (zero, mu) = (vec![0.0; model.len()], vec![0.0; model.constraints()]);
        Self::recorded(|recorder| model.constraint_second(0.0, &zero, &mu, recorder))
    }

    fn recorded(run: impl FnOnce(&mut Recorder)) -> Self {
        let mut recorder = Recorder(Vec::new());
        run(&mut recorder);
        Self::sorted(&recorder.0)
    }

    fn sorted(recorded: &[(Block, usize, usize)]) -> Self {
        let by_column = |(block, row, column): &(Block, usize, usize)| (*block, *column, *row);
        let mut places = recorded.to_vec();
        places.sort_unstable_by_key(by_column);
        places.dedup();
        let place = |one| places.binary_search_by_key(&by_column(one), by_column);
        let contributions = recorded.iter().map(|one| place(one).unwrap_or(0));
        let contributions = contributions.collect();
        Self {
            places,
            contributions,
        }
    }

    /// The places, sorted by block, column and row.
    #[must_use]
    pub fn places(&self) -> &[(Block, usize, usize)] {
        &self.places
    }

    /// sum += factor · M x, for values of M in these places.
    #[cfg(feature = "sparse")]
    pub(super) fn add_product(&self, values: &[f64], factor: f64, x: &[f64], sum: &mut [f64]) {
        for ((_, row, column), value) in self.places.iter().zip(values) {
            sum[*row] += factor * (value * x[*column]);
        }
    }

    /// sum += factor · Mᵀ x
    #[cfg(feature = "sparse")]
    pub(super) fn add_transposed(&self, values: &[f64], factor: f64, x: &[f64], sum: &mut [f64]) {
        for ((_, row, column), value) in self.places.iter().zip(values) {
            sum[*column] += factor * (value * x[*row]);
        }
    }

    /// Receives the values of a kernel, one for each place; `values` is set to zero first.
    pub fn scatter<'a>(&'a self, values: &'a mut [f64]) -> Values<'a> {
        values.fill(0.0);
        self.add_to(values)
    }

    /// The same for any kind of numbers, added to the present values.
    pub(super) fn add_to<'a, R>(&'a self, values: &'a mut [R]) -> Values<'a, R> {
        Values {
            contributions: self.contributions.iter(),
            values,
        }
    }
}
