//! Steps over nodes at which constraints lose rank (T-120): the element at such a node ends beyond it.

use super::any::AnyStepper;
use super::common::Common;
use super::piece::{Ahead, Piece};
use crate::constrained::rows::Independence;
use crate::cut::is_of_newton;
use crate::error::{ConstraintError, StepError};
use crate::method::Impulse;
use crate::model::State;
use crate::newton::Solve;
use alloc::vec::Vec;

/// How far before the node the element over it begins, as fractions of the step; they are tried one after the other.
/// Farther away less is lost to rounding, nearer the polynomial is more accurate at the node.
const REACHES: [f64; 5] = [1.0 / 64.0, 1.0 / 16.0, 1.0 / 256.0, 1.0 / 4.0, 1.0 / 1024.0];

/// How far beyond the node it ends, as a fraction of that distance: no point of the element may lie on the node.
const BEHIND: f64 = 0.75;

/// If the independent part of a constraint's row is smaller than this, positions and velocities lose digits: their
/// error is that of a rounding divided by this part.
const LOST: f64 = 1e-4;

/// This is attributed to the end of a step, and not to the model, if the part is smaller by this factor than at the
/// start.
const LOST_HERE: f64 = 0.125;

/// A row whose length has shrunk by this factor is about to vanish.
const VANISHING: f64 = 1e-2;

/// Whether the constraints lose much of their independence from the start of a step to its end.
fn is_lost(start: &Independence, end: &Independence) -> bool {
    end.rank < start.rank
        || end.least < LOST.min(LOST_HERE * start.least)
        || end.shortest < VANISHING * start.shortest
}

/// Whether a step may have failed because the constraints lose rank near its end.
fn is_of_the_place(error: &StepError) -> bool {
    is_of_newton(error)
        || matches!(
            error,
            StepError::Constraint(
                ConstraintError::Dependent { .. } | ConstraintError::SingularMass
            )
        )
}

impl<const N: usize> Common<N> {
    /// Whether the constraints are much less independent at the end of the last step than at its start.
    fn loses_rank(&self) -> bool {
        let start = (self.carried.pieces.first())
            .map_or(self.carried.memory.independence, |one| one.independence);
        match (start, self.carried.memory.independence) {
            (Some([start, _]), Some([_, end])) => is_lost(&start, &end),
            _ => false,
        }
    }
}

impl<const N: usize> dyn AnyStepper<N> + '_ {
    /// A step of a model with constraints.
    pub(super) fn advance_constrained(
        &mut self,
        t: f64,
        h: f64,
        state: &mut State<N>,
        impulses: &[Impulse<N>],
    ) -> Result<(), StepError> {
        let of = self.dimensions();
        let carried = &mut self.common().carried;
        carried.passes_node = false;
        let ahead = carried.ahead.take().filter(|_| impulses.is_empty());
        if let Some(ahead) = ahead.filter(|one| one.serves(t, h, state)) {
            return self.go_on(ahead, (t, h), state);
        }
        let common = self.common();
        common.take_foreseen(of, (t, h));
        let (start, cuts) = (*state, common.carried.memory.statistics.cuts);
        let outcome = self.advance_plainly(t, h, state, impulses);
        let solve = self.common().control.solve;
        if !(impulses.is_empty() && matches!(solve, Solve::Auto | Solve::Newton)) {
            return outcome;
        }
        match outcome {
            Ok(()) if self.common().loses_rank() => {
                let done = self.common().clone();
                let mut moved = start;
                let statistics = &mut self.common().carried.memory.statistics;
                statistics.cuts = cuts;
                statistics.steps -= 1;
                if self.over((t, h), &mut moved) {
                    *state = moved;
                } else {
                    *self.common() = done;
                }
                Ok(())
            }
            Err(error) if is_of_the_place(&error) && self.over((t, h), state) => Ok(()),
            outcome => outcome,
        }
    }

    /// A step from a node that the last element has passed.
    fn go_on(
        &mut self,
        ahead: Ahead<N>,
        (t, h): (f64, f64),
        state: &mut State<N>,
    ) -> Result<(), StepError> {
        let start = *state;
        *state = ahead.state;
        let rest = (t + h) - ahead.t;
        // Its end may be another such node.
        if let Err(error) = self.advance_constrained(ahead.t, rest, state, &[]) {
            *state = start;
            return Err(error);
        }
        if self.common().carried.pieces.is_empty() {
            self.passed(ahead.t, rest, Vec::new());
        }
        let carried = &mut self.common().carried;
        carried.pieces.insert(0, ahead.piece);
        carried.passes_node = true;
        Ok(())
    }

    /// Moves `state` to a node near which the constraints lose rank, by an element that ends beyond it and whose
    /// polynomial gives the state at the node. False, with nothing changed, if that fails.
    #[cold]
    fn over(&mut self, (t, h): (f64, f64), state: &mut State<N>) -> bool {
        let (start, steps) = (*state, self.common().carried.memory.statistics.steps);
        let passes = REACHES
            .iter()
            .any(|reach| self.over_from((t, h), reach * h, state));
        let carried = &mut self.common().carried;
        carried.memory.statistics.steps = steps;
        if !passes {
            (*state, carried.memory.last) = (start, None);
            carried.pieces.clear();
            return false;
        }
        carried.memory.statistics.steps += 1;
        carried.memory.statistics.cuts += 1;
        carried.passes_node = true;
        true
    }

    fn over_from(&mut self, (t, h): (f64, f64), reach: f64, state: &mut State<N>) -> bool {
        let start = *state;
        let carried = &mut self.common().carried;
        carried.pieces.clear();
        carried.memory.last = None;
        let (before, length) = (h - reach, reach + BEHIND * reach);
        let mut moved = start;
        if self.whole(t, before, &mut moved, &[]).is_err() {
            return false;
        }
        self.passed(t, before, Vec::new());
        let begins = t + before;
        if self.whole(begins, length, &mut moved, &[]).is_err() {
            return false;
        }
        let ends = begins + length;
        self.passed(begins, length, Vec::new());
        let carried = &mut self.common().carried;
        let Some(mut piece) = carried.pieces.pop() else {
            return false;
        };
        let (to_node, from_node) = piece.dense.split(t + h);
        let node = to_node.at(1.0);
        carried.pieces.push(Piece {
            dense: to_node,
            ..piece.clone()
        });
        piece.dense = from_node;
        carried.ahead = Some(Ahead {
            node,
            t: ends,
            state: moved,
            piece,
        });
        *state = node;
        true
    }
}
