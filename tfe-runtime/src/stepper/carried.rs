//! What a stepper carries from step to step, without its model.

use super::piece::{Ahead, Piece};
use crate::dense::DenseElement;
use crate::method::{Impulse, Memory};
use crate::points::Points;
use crate::propagator::Propagator;
use crate::registers::storage::Heap;
use alloc::vec::Vec;

/// The same for whichever model is stepped.
#[derive(Clone, Debug)]
pub(super) struct Carried<const N: usize> {
    pub(super) memory: Memory<N>,
    pub(super) numbers: Vec<f64>,
    pub(super) pivots: Vec<usize>,
    pub(super) impulses: Vec<Impulse<N>>,
    /// Whether dense output is not requested for every step.
    pub(super) ends_only: bool,
    /// For a linear model, once it has paid to make it.
    pub(super) propagator: Option<Propagator<N>>,
    /// The iteration with all points at once, where model and element allow it.
    pub(super) points: Option<Points<N, Heap>>,
    /// The length of the last steps, and their number.
    pub(super) alike: (f64, usize),
    /// Whether the workspace does not hold the last step.
    pub(super) skipped: bool,
    /// The pieces of the last step, if it was cut.
    pub(super) pieces: Vec<Piece<N>>,
    /// Where the last element ended, if that was beyond the node.
    pub(super) ahead: Option<Ahead<N>>,
    /// Whether an element of the last step passed over one of its nodes.
    pub(super) passes_node: bool,
}

impl<const N: usize> Carried<N> {
    /// Before the first step.
    pub(super) fn at_rest(points: Option<Points<N, Heap>>) -> Self {
        Self {
            memory: Memory::new(),
            numbers: Vec::new(),
            pivots: Vec::new(),
            impulses: Vec::new(),
            ends_only: false,
            propagator: None,
            points,
            alike: (0.0, 0),
            skipped: false,
            pieces: Vec::new(),
            ahead: None,
            passes_node: false,
        }
    }

    /// The polynomials of a last step that was cut.
    pub(super) fn dense_of_pieces(&self, start: f64, end: f64) -> Option<DenseElement<N>> {
        let pieces = self.pieces.iter().map(|piece| piece.dense.clone());
        DenseElement::of_pieces((start, end), pieces.collect())
    }
}
