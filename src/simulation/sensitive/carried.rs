//! The derivatives along a run of a model of either kind of length: over events, and at recorded nodes (T-124).

use super::acts::Acting;
use super::jump::{Jump, VariedModel};
use crate::error::RunErrorKind;
use crate::length::Length;
use crate::motion::{Event, Motion, Node};
use crate::sensitivity::inside::{Before, Inside, Moved};
use crate::sensitivity::slopes::Change;
use crate::sensitivity::{Sensitive, Slopes};
use crate::simulation::events::Severed;
use crate::simulation::events::value::output_slopes;
use nalgebra::{DMatrix, RowDVector};
use tfe_runtime::step::DenseElement;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{CoordinateName, InsideSlopes};

/// The derivatives at the current point of a run, and those collected so far.
pub(in crate::simulation) struct Carried {
    /// The indices of the parameters.
    indices: Vec<usize>,
    /// The derivatives at the current state.
    pub(in crate::simulation) before: Before,
    /// ∂(p, q)/∂(start, parameters) after the action that follows.
    acted: Option<DMatrix<f64>>,
    /// The error of an action that sets a parameter to a value which depends on the state.
    dependent: Option<RunErrorKind>,
    nodes: Vec<Slopes>,
    /// The derivatives along the elements so far, if asked for.
    inside: Option<Vec<Inside>>,
    events: Vec<(usize, Vec<f64>)>,
}

/// The derivatives of the state at an event, before its action.
pub(in crate::simulation) struct Reached {
    /// The derivatives at fixed time, by the start and by parameters.
    pub(in crate::simulation) at: DMatrix<f64>,
    /// The time derivative ẏ, one column.
    pub(in crate::simulation) rate: DMatrix<f64>,
}

/// The derivatives along an element.
pub(in crate::simulation) struct Along {
    /// The times of its start and its end.
    pub(in crate::simulation) times: (f64, f64),
    pub(in crate::simulation) pieces: Vec<AlongPiece>,
    /// The derivatives at the start of the element, with which those of the pieces are multiplied.
    pub(in crate::simulation) before: Before,
}

/// The derivatives along a piece of an element; the element is the only piece if it was not cut.
pub(in crate::simulation) struct AlongPiece {
    pub(in crate::simulation) times: (f64, f64),
    pub(in crate::simulation) length: f64,
    pub(in crate::simulation) slopes: InsideSlopes,
    /// The Legendre coefficients of dq/dτ, a row with a number for each coordinate, followed by those of dp/dτ.
    pub(in crate::simulation) values: Vec<f64>,
}

impl Along {
    /// The derivatives along an element of a model of fixed size, solved between these times.
    pub(super) fn of<const N: usize>(
        dense: &DenseElement<N>,
        times: (f64, f64),
        inside: Vec<InsideSlopes>,
        before: &Before,
    ) -> Self {
        let pieces = inside.into_iter().zip(dense.pieces());
        let piece = |(slopes, piece): (InsideSlopes, &DenseElement<N>)| AlongPiece {
            times: (piece.start(), piece.end()),
            length: piece.length(),
            slopes,
            values: piece.coefficients().as_flattened().to_vec(),
        };
        Self {
            times,
            pieces: pieces.map(piece).collect(),
            before: before.clone(),
        }
    }
}

impl Carried {
    /// The derivatives at the start of a run, by the start and by parameters of given indices.
    pub(in crate::simulation) fn new(coordinates: usize, indices: &[usize]) -> Self {
        let size = 2 * coordinates;
        Self {
            indices: indices.to_vec(),
            before: Before {
                state: DMatrix::identity(size, size + indices.len()),
                start: None,
            },
            acted: None,
            dependent: None,
            nodes: Vec::new(),
            inside: None,
            events: Vec::new(),
        }
    }

    /// Also keeps the derivatives along elements.
    pub(in crate::simulation) fn with_inside(self) -> Self {
        Self {
            inside: Some(Vec::new()),
            ..self
        }
    }

    pub(in crate::simulation) fn keeps_inside(&self) -> bool {
        self.inside.is_some()
    }

    /// Returns the derivatives since the start or the last call, and counts them anew from here.
    pub(in crate::simulation) fn restart(&mut self) -> DMatrix<f64> {
        let (size, columns) = self.before.state.shape();
        self.before.start = None;
        std::mem::replace(&mut self.before.state, DMatrix::identity(size, columns))
    }

    /// The indices of the parameters.
    #[cfg(feature = "sparse")]
    pub(in crate::simulation) fn indices(&self) -> &[usize] {
        &self.indices
    }

    pub(in crate::simulation) fn columns(&self) -> usize {
        self.before.state.ncols()
    }

    /// The index of the parameter of a column; `None` for a column of the start.
    fn parameter(&self, column: usize) -> Option<usize> {
        let size = self.before.state.nrows();
        self.indices.get(column.checked_sub(size)?).copied()
    }

    /// The derivative of the time of the current point by the quantity of a column; zero unless an event is there.
    fn moved(&self, column: usize) -> f64 {
        let moved = self.before.start.as_ref();
        moved.map_or(0.0, |moved| moved[column])
    }

    pub(in crate::simulation) fn into_sensitive<const N: usize, L: Length<N>>(
        self,
        motion: Motion<N, L>,
        name: impl Fn(usize) -> CoordinateName,
    ) -> Sensitive<N, L> {
        let names = self.indices.iter();
        let names = names.map(|index| name(*index).to_string());
        let inside = self.inside.unwrap_or_default();
        Sensitive::new(motion, names.collect(), self.nodes, self.events).with_inside(inside)
    }

    /// The derivatives at an event at the start of an element, before its action.
    pub(in crate::simulation) fn at_start<L: Length<N>, const N: usize>(
        &self,
        model: &dyn VariedModel<N, L>,
        event: &Event<N, L>,
    ) -> Reached {
        let node = Node::of(event.t, &event.state(), event.v.clone());
        let push = model.push(&node);
        let both = push.as_ref().iter().chain(event.v.as_ref());
        let rate = DMatrix::from_iterator(self.before.state.nrows(), 1, both.copied());
        let mut at = self.before.state.clone();
        if let Some(moved) = &self.before.start {
            // A later start shortens the time to the fixed end.
            for (mut column, dt) in at.column_iter_mut().zip(moved) {
                column.axpy(-dt, &rate.column(0), 1.0);
            }
        }
        Reached { at, rate }
    }

    /// The derivatives of the time of an event by each column, from those of the state at a fixed time.
    pub(in crate::simulation) fn times<L: Length<N>, const N: usize>(
        &self,
        jump: &Jump<'_, '_, N, L>,
        at: &DMatrix<f64>,
    ) -> Result<Vec<f64>, TransitionError> {
        let start = self.before.start.as_deref();
        jump.times(at, start, &|column| self.parameter(column))
    }

    /// Keeps the derivatives along an element; `ends` are the derivatives of its end time, if an event ends it.
    pub(in crate::simulation) fn keep(&mut self, along: Along, ends: Option<&[f64]>) {
        let Some(mut inside) = self.inside.take() else {
            return;
        };
        let Along {
            times: (start, end),
            pieces,
            before,
        } = along;
        for piece in pieces {
            let times = piece.times;
            let is_between_kinks = !piece.slopes.ends[0].is_empty();
            let moved = if is_between_kinks {
                let through = |row: &Vec<f64>| {
                    let row = DMatrix::from_row_slice(1, row.len(), row);
                    before.through(&row, ends).row(0).into_owned()
                };
                Some(piece.slopes.ends.each_ref().map(through))
            } else if self.before.start.is_some() || ends.is_some() {
                let still = vec![0.0; self.columns()];
                let starts = self.before.start.as_ref().unwrap_or(&still);
                let starts = RowDVector::from_row_slice(starts);
                let ends = RowDVector::from_row_slice(ends.unwrap_or(&still));
                let at = |t: f64| {
                    let part = (t - start) / (end - start);
                    &starts * (1.0 - part) + &ends * part
                };
                Some([at(times.0), at(times.1)])
            } else {
                None
            };
            let moved = moved.map(|ends| Moved {
                ends,
                values: piece.values,
            });
            inside.push(Inside {
                times,
                length: piece.length,
                slopes: piece.slopes,
                before: before.clone(),
                ends: ends.map(<[f64]>::to_vec),
                moved,
            });
        }
        self.inside = Some(inside);
    }

    /// Continues from the end of an element that no event has cut, with the derivatives there.
    pub(in crate::simulation) fn passed(&mut self, end: DMatrix<f64>) {
        (self.before.state, self.before.start) = (end, None);
    }

    /// Continues from an event that cuts an element, and keeps the derivatives along the part before it, if given.
    pub(in crate::simulation) fn cut<L: Length<N>, const N: usize>(
        &mut self,
        model: &dyn VariedModel<N, L>,
        severed: &Severed<'_, '_, N, L>,
        mut reached: Reached,
        along: Option<Along>,
    ) -> Result<(), TransitionError> {
        let event = severed.event;
        let node = Node::of(event.t, &event.state(), event.v.clone());
        let jump = Jump::at(model, severed, &node, &reached.rate);
        let times = self.times(&jump, &reached.at)?;
        if let Some(along) = along {
            self.keep(along, Some(&times));
        }
        let Reached { at, rate } = &mut reached;
        for (mut column, dt) in at.column_iter_mut().zip(&times) {
            column.axpy(*dt, &rate.column(0), 1.0);
        }
        (self.acted, self.dependent) = (None, None);
        if severed.goes_on {
            let acting = Acting {
                jump: &jump,
                at,
                times: &times,
            };
            self.acted = Some(acting.after(&|column| self.parameter(column))?);
            // If derivatives by parameters are asked for, actions that set parameters are refused.
            if self.indices.is_empty() {
                self.dependent = acting.dependent();
            }
        }
        self.before.state = reached.at;
        self.events.push((severed.number, times.clone()));
        self.before.start = Some(times);
        Ok(())
    }

    /// Continues after the action at that event.
    pub(in crate::simulation) fn acted(&mut self) {
        if let Some(acted) = self.acted.take() {
            self.before.state = acted;
        }
    }

    /// Parameters were set at that event.
    ///
    /// # Errors
    /// If derivatives by parameters are asked for, and if a value that was set depends on the state.
    pub(in crate::simulation) fn set(&mut self) -> Result<(), RunErrorKind> {
        if !self.indices.is_empty() {
            let call = "run_sensitive";
            return Err(RunErrorKind::SetUnsupported { call });
        }
        self.dependent.take().map_or(Ok(()), Err)
    }

    /// Keeps the derivatives at a recorded node.
    pub(in crate::simulation) fn recorded<L: Length<N>, const N: usize>(
        &mut self,
        model: &dyn VariedModel<N, L>,
        node: &Node<N, L>,
    ) {
        let velocity_along = model.velocity_along(node);
        let columns = self.columns();
        let mut slopes = Slopes {
            state: self.before.state.clone(),
            velocity: DMatrix::zeros(self.before.state.nrows() / 2, columns),
            outputs: DMatrix::zeros(model.output_count(), columns),
        };
        for column in 0..columns {
            let change = Change {
                // The time of an event moves, too.
                t: self.moved(column),
                parameter: self.parameter(column),
                ..Change::of_column(&node.q, &self.before.state, column)
            };
            let velocity = velocity_along(&change);
            slopes
                .velocity
                .column_mut(column)
                .copy_from_slice(velocity.as_ref());
            if slopes.outputs.nrows() > 0 {
                let place = (node.t, &node.q, &node.p, &node.v);
                let outputs = output_slopes(model, place, &change, &velocity);
                slopes.outputs.column_mut(column).copy_from_slice(&outputs);
            }
        }
        self.nodes.push(slopes);
    }
}
