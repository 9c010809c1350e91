//! The result of an ensemble: the ends of its runs.

use super::doubts::WarningCounts;
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length};
use crate::motion::Node;
use std::ops::Index;
use tfe_runtime::Statistics;

/// The end of a run, or the error that stopped it.
pub(super) type Outcome<const N: usize, L> = Result<Node<N, L>, RunErrorKind>;

/// Called with the index of a run that has ended, and its end.
pub(super) type Finished<'a, const N: usize, L> = dyn Fn(usize, Outcome<N, L>) + Send + Sync + 'a;

/// The results of an [`Ensemble`](crate::Ensemble), in the order of its starts.
///
/// `ends[k]` is the result of run k: the node at the end of the span, or why the run stopped before.
#[derive(Clone, Debug, PartialEq)]
pub struct Ends<const N: usize, L: Length<N> = FixedLength> {
    results: Vec<Outcome<N, L>>,
    statistics: Statistics,
    warnings: WarningCounts,
}

/// A run that did not reach the end of the span.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Failure<'a> {
    /// The index of the run, from 0.
    pub index: usize,
    /// Where and why the run stopped.
    pub kind: &'a RunErrorKind,
}

impl<const N: usize, L: Length<N>> Ends<N, L> {
    pub(super) fn new(
        results: Vec<Result<Node<N, L>, RunErrorKind>>,
        statistics: Statistics,
        warnings: WarningCounts,
    ) -> Self {
        Self {
            results,
            statistics,
            warnings,
        }
    }

    /// The number of runs.
    pub fn len(&self) -> usize {
        self.results.len()
    }

    /// Whether there were no starts.
    pub fn is_empty(&self) -> bool {
        self.results.is_empty()
    }

    /// The result of run `index`; `None` if there is no such run.
    pub fn get(&self, index: usize) -> Option<&Result<Node<N, L>, RunErrorKind>> {
        self.results.get(index)
    }

    /// All results, in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Result<Node<N, L>, RunErrorKind>> {
        self.results.iter()
    }

    /// The end nodes of all runs that reached the end of the span, in order.
    pub fn nodes(&self) -> impl Iterator<Item = &Node<N, L>> {
        self.results
            .iter()
            .filter_map(|result| result.as_ref().ok())
    }

    /// The runs that did not reach the end of the span, in order.
    pub fn failures(&self) -> impl Iterator<Item = Failure<'_>> {
        self.results
            .iter()
            .enumerate()
            .filter_map(|(index, result)| {
                let kind = result.as_ref().err()?;
                Some(Failure { index, kind })
            })
    }

    /// Counts of iterations, evaluations and factorisations of all runs together.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// How many of the runs that reached their ends may be wrong, by the kind of warning.
    pub fn warnings(&self) -> &WarningCounts {
        &self.warnings
    }

    /// All results by value, in order.
    pub fn into_results(self) -> Vec<Result<Node<N, L>, RunErrorKind>> {
        self.results
    }
}

impl<const N: usize, L: Length<N>> Index<usize> for Ends<N, L> {
    type Output = Result<Node<N, L>, RunErrorKind>;

    /// The result of run `index`.
    ///
    /// # Panics
    /// If there is no such run; [`Ends::get`] returns `None` then.
    fn index(&self, index: usize) -> &Self::Output {
        &self.results[index]
    }
}

impl<'a, const N: usize, L: Length<N>> IntoIterator for &'a Ends<N, L> {
    type Item = &'a Result<Node<N, L>, RunErrorKind>;
    type IntoIter = std::slice::Iter<'a, Result<Node<N, L>, RunErrorKind>>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<const N: usize, L: Length<N>> IntoIterator for Ends<N, L> {
    type Item = Result<Node<N, L>, RunErrorKind>;
    type IntoIter = std::vec::IntoIter<Result<Node<N, L>, RunErrorKind>>;

    fn into_iter(self) -> Self::IntoIter {
        self.results.into_iter()
    }
}
