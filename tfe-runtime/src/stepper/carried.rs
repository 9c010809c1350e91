//! What a stepper carries from step to step, without its model.

use super::piece::{Ahead, Piece};
use crate::dense::DenseElement;
use crate::method::{Impulse, Last, Memory};
use crate::model::State;
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

    /// Whether so many steps had this length that a propagator, which costs 2N + 1 steps, pays; counts the next one.
    pub(super) fn is_alike(&mut self, h: f64) -> bool {
        self.alike = if self.alike.0 == h {
            (h, self.alike.1.saturating_add(1))
        } else {
            (h, 1)
        };
        self.alike.1 > 2 * N + 1
    }

    /// Moves `state` by the propagator; false where the end is not finite, for which the ordinary step reports the
    /// reason.
    pub(super) fn propagate(&mut self, (t, h): (f64, f64), state: &mut State<N>) -> bool {
        let Some(propagator) = &self.propagator else {
            return false;
        };
        let start = *state;
        let mut low = match &self.memory.last {
            Some(last) if last.end.is_same(&start) => self.memory.low,
            _ => State::ZERO,
        };
        let start_low = low;
        if !propagator.advance(state, &mut low) {
            return false;
        }
        self.memory.last = Some(Last {
            t,
            h,
            start,
            start_low,
            end: *state,
        });
        self.memory.low = low;
        self.memory.statistics.steps += 1;
        self.memory.statistics.products += 1;
        self.skipped = true;
        true
    }

    /// Time and state at the end of the last step.
    pub(super) fn place(&self) -> (f64, State<N>) {
        let last = self.memory.last;
        last.map_or((0.0, State::ZERO), |last| (last.t + last.h, last.end))
    }

    /// The polynomials of a last step that was cut.
    pub(super) fn dense_of_pieces(&self, start: f64, end: f64) -> Option<DenseElement<N>> {
        let pieces = self.pieces.iter().map(|piece| piece.dense.clone());
        DenseElement::of_pieces((start, end), pieces.collect())
    }
}
