//! Pieces of steps that were cut, and elements that end beyond their node.

use crate::constrained::rows::Independence;
use crate::dense::DenseElement;
use crate::method::{Impulse, Last};
use crate::model::State;
use alloc::vec::Vec;

/// What determines the time of the end of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ends {
    /// A part of the step.
    Still,
    /// The root of a switching function, given by its index.
    Root(usize),
    /// The end of the piece before, which ends at such a root: the length of this one is fixed.
    Behind,
}

/// A piece of a step that was cut.
#[derive(Clone, Debug)]
pub(super) struct Piece<const N: usize> {
    pub(super) last: Last<N>,
    pub(super) ends: Ends,
    pub(super) impulses: Vec<Impulse<N>>,
    pub(super) dense: DenseElement<N>,
    pub(super) independence: Option<[Independence; 2]>,
    /// The workspace after it.
    pub(super) numbers: Vec<f64>,
    pub(super) pivots: Vec<usize>,
}

/// Where an element ended beyond the last node.
#[derive(Clone, Debug)]
pub(super) struct Ahead<const N: usize> {
    pub(super) node: State<N>,
    pub(super) t: f64,
    pub(super) state: State<N>,
    /// The piece from the node to there.
    pub(super) piece: Piece<N>,
}

impl<const N: usize> Ahead<N> {
    /// Whether a step begins at the node and ends beyond that element.
    pub(super) fn serves(&self, t: f64, h: f64, state: &State<N>) -> bool {
        let done = (self.t - t) / h;
        self.node.is_same(state) && done > 0.0 && done < 1.0
    }
}
