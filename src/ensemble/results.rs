//! Collects the results of batches.

use super::doubts::WarningCounts;
use super::ends::Ends;
use crate::error::RunErrorKind;
use crate::length::Length;
use crate::motion::Node;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tfe_runtime::Statistics;

/// Results in the order in which they are finished.
pub(super) struct Results<const N: usize, L: Length<N>> {
    results: Vec<Option<Result<Node<N, L>, RunErrorKind>>>,
    warnings: WarningCounts,
}

impl<const N: usize, L: Length<N>> Results<N, L> {
    pub(super) fn new(count: usize) -> Self {
        Self {
            results: (0..count).map(|_| None).collect(),
            warnings: WarningCounts::default(),
        }
    }

    pub(super) fn put(
        &mut self,
        index: usize,
        result: Result<Node<N, L>, RunErrorKind>,
        warnings: WarningCounts,
    ) {
        if let Some(place) = self.results.get_mut(index) {
            *place = Some(result);
        }
        self.warnings.add(warnings);
    }

    /// Converts the complete results to [`Ends`], in the same memory.
    pub(super) fn into_ends(self, statistics: Statistics) -> Ends<N, L> {
        let results = self.results.into_iter().map_while(|result| result);
        Ends::new(results.collect(), statistics, self.warnings)
    }
}

/// Locks, also after a panic in another thread: the data remain valid.
pub(super) fn lock<T>(place: &Mutex<T>) -> MutexGuard<'_, T> {
    place.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn unlock<T>(place: Mutex<T>) -> T {
    place.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// Solves batches, given by their numbers, in a place of its own.
type Solving<'a> = Box<dyn FnMut(usize) -> Statistics + 'a>;

/// Adds up the work of all batches. A place that `place` creates is used for many of them, one after the other.
pub(super) fn summed<P>(
    batches: usize,
    place: impl Fn() -> P + Send + Sync,
    batch: impl Fn(&mut P, usize) -> Statistics + Send + Sync,
) -> Statistics {
    let batch = &batch;
    total(batches, &|| {
        let mut place = place();
        Box::new(move |number: usize| batch(&mut place, number))
    })
}

/// The same, compiled once, and not for every model.
#[cfg(feature = "parallel")]
fn total<'a>(batches: usize, begin: &(dyn Fn() -> Solving<'a> + Send + Sync)) -> Statistics {
    use rayon::iter::{IntoParallelIterator, ParallelIterator};
    (0..batches)
        .into_par_iter()
        .map_init(begin, |solve, number| solve(number))
        .reduce(Statistics::default, merged)
}

#[cfg(not(feature = "parallel"))]
fn total<'a>(batches: usize, begin: &(dyn Fn() -> Solving<'a> + Send + Sync)) -> Statistics {
    let solve = begin();
    (0..batches).map(solve).fold(Statistics::default(), merged)
}

fn merged(mut sum: Statistics, other: Statistics) -> Statistics {
    sum.merge(&other);
    sum
}
