//! Values and bounds of the watched functions.

use super::model::EventModel;
use super::search::ZeroProof;
use super::searched::Searched;
use super::value::Value;
use super::{Events, Passage};
use crate::length::{Length, Polynomial};
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;

impl<const N: usize, L: Length<N>> Events<'_, N, L> {
    /// Writes the values of the watched functions at a place of an element; at its ends those of the nodes.
    pub(super) fn write_row_at(
        &self,
        model: &dyn EventModel<N, L>,
        arc: &Passage<'_, N, L>,
        tau: f64,
        row: &mut Vec<f64>,
    ) {
        let Passage { t, h, dense, .. } = *arc;
        let time = t + tau * h;
        if 0.0 < tau && tau < 1.0 {
            let state = dense.at_time(time);
            let v = self.velocity_inside(dense, time, &state);
            self.outputs(model, (time, &state, &v), row);
            return;
        }
        let state = if tau == 0.0 { arc.before } else { arc.after };
        let (q, _) = L::parts(state);
        if !self.needs_velocity {
            self.outputs(model, (time, state, &L::zero(q)), row);
            return;
        }
        // The end of one element and the start of the next are the same node.
        let time = if tau == 0.0 { t } else { dense.end() };
        let v = model.velocity(time, state, &L::zero(q));
        let v = v.unwrap_or_else(|| L::unknown(q));
        self.outputs(model, (time, state, &v), row);
    }

    pub(super) fn row_at(
        &self,
        model: &dyn EventModel<N, L>,
        arc: &Passage<'_, N, L>,
        tau: f64,
    ) -> Vec<f64> {
        let mut row = Vec::new();
        self.write_row_at(model, arc, tau, &mut row);
        row
    }

    /// The velocity inside an element; zero if no watched function needs it.
    pub(super) fn velocity_inside(
        &self,
        dense: &L::Polynomial,
        time: f64,
        state: &L::State,
    ) -> L::Vector {
        if self.needs_velocity {
            dense.velocity_at_time(time)
        } else {
            let (q, _) = L::parts(state);
            L::zero(q)
        }
    }

    /// The values of the watched functions.
    pub(super) fn row(
        &self,
        model: &dyn EventModel<N, L>,
        place: (f64, &L::State, &L::Vector),
    ) -> Vec<f64> {
        let mut row = Vec::with_capacity(self.watched.len());
        self.outputs(model, place, &mut row);
        row
    }

    /// Writes the values of the watched functions.
    pub(super) fn outputs(
        &self,
        model: &dyn EventModel<N, L>,
        (t, state, v): (f64, &L::State, &L::Vector),
        row: &mut Vec<f64>,
    ) {
        let mut values = self.rooms.values.borrow_mut();
        model.outputs(t, L::parts(state), v, &mut values);
        let (q, _) = L::parts(state);
        row.extend(self.watched.iter().map(|watched| match &watched.value {
            Value::Column(column) => values[*column],
            Value::Function(function) => function(t, q, v),
        }));
    }

    /// Whether bounds prove that no watched function vanishes in an element. Signs that were unknown are then known.
    pub(super) fn stays_off(&mut self, run: &dyn Searched<N, L>, dense: &L::Polynomial) -> bool {
        if self.has_functions() {
            return false;
        }
        for piece in dense.pieces() {
            let mut values = self.rooms.bounds.borrow_mut();
            run.outputs_along(piece, &mut values);
            for (watched, known) in self.watched.iter().zip(&mut self.seen.sides) {
                let Value::Column(column) = watched.value else {
                    return false;
                };
                let side = values[column].side();
                if side == 0.0 || *known == -side {
                    return false;
                }
                *known = side;
            }
        }
        true
    }

    /// What bounds prove about a watched function in a part of an element.
    pub(super) fn course(
        &self,
        run: &dyn Searched<N, L>,
        dense: &L::Polynomial,
        function: usize,
        part: (f64, f64),
    ) -> ZeroProof {
        let Value::Column(column) = self.watched[function].value else {
            return ZeroProof::Unbounded;
        };
        let length = dense.end() - dense.start();
        // The piece that contains the whole part, if there is one.
        let place = |piece: &L::Polynomial| {
            let from = (piece.start() - dense.start()) / length;
            let to = (piece.end() - dense.start()) / length;
            ((part.0 - from) / (to - from), (part.1 - from) / (to - from))
        };
        let holds = |(from, to): &(f64, f64)| *from >= 0.0 && *to <= 1.0;
        let mut pieces = dense.pieces().iter().map(|piece| (piece, place(piece)));
        let Some((piece, within)) = pieces.find(|(_, within)| holds(within)) else {
            return ZeroProof::Unproved;
        };
        let mut values = self.rooms.slopes.borrow_mut();
        run.outputs_over(piece, within, &mut values);
        let Dual { value, slope, .. } = values[column];
        if value.side() != 0.0 || slope.side() != 0.0 {
            ZeroProof::AtMostOne
        } else if value == Enclosure::WHOLE {
            ZeroProof::Unbounded
        } else {
            ZeroProof::Unproved
        }
    }
}
