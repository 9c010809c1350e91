//! Runs with derivatives by parameters and by the start (T-123, T-124).

mod acts;
mod family;

use super::checks::check_kinks;
use super::events::Severed;
use super::follow::{Follow, Passed};
use super::setup::Simulation;
use crate::constraints::tangent_basis;
use crate::error::{RunError, RunErrorKind};
use crate::motion::{Motion, Node};
use crate::sensitivity::inside::{Before, Inside, Moved};
use crate::sensitivity::slopes::{Along, Change, Place, directions};
use crate::sensitivity::{Sensitive, Slopes};
use acts::Acting;
use nalgebra::{DMatrix, RowDVector};
use std::convert::identity;
use std::ops::Range;
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{
    ConstraintError, Direction, Element, First, Form, InsideSlopes, Model, Share, State, StepError,
};

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    /// Runs over the span as [`run`](Self::run) does, and keeps the derivatives of every recorded node with respect to
    /// all parameters of the model and to the start (forward sensitivities, T-123, T-124). There is an example at
    /// [`Sensitive`].
    ///
    /// The derivatives are those of the computed motion, exact up to rounding: parameters declared with
    /// `sensitivity(…)` have kernels of their own, others are differentiated by dual numbers in the model's kernels.
    /// Each step costs, besides, one factorisation of its tangent, one solution for each number of the start and each
    /// parameter, and as many products of matrices. The functions given to [`on`](Self::on) are called several times
    /// with nearby states, for differences of sixth order. For the gradient of one number with respect to many
    /// parameters, [`gradient`](Self::gradient) is cheaper.
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run). [`RunErrorKind::Transition`] if an element or an event has no
    /// derivative, [`RunErrorKind::KinksUnsupported`] after [`at_kinks(true)`](Self::at_kinks), because the times of
    /// the cuts depend on the state and the parameters.
    pub fn run_sensitive(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Sensitive<N>, RunError<N>> {
        let all: Vec<_> = (0..self.model.parameters()).collect();
        let tangents = self.tangents(&all);
        match self.record_every {
            1 => self.differentiated(start, span, tangents.with_inside()),
            _ => self.differentiated(start, span, tangents),
        }
    }

    /// The same at nodes only.
    pub(super) fn run_sensitive_at_nodes(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Sensitive<N>, RunError<N>> {
        let all: Vec<_> = (0..self.model.parameters()).collect();
        self.differentiated(start, span, self.tangents(&all))
    }

    /// The same by some of the parameters, at nodes only.
    #[cfg(feature = "fit")]
    pub(crate) fn run_sensitive_by(
        &self,
        start: State<N>,
        span: Range<f64>,
        parameters: &[usize],
    ) -> Result<Sensitive<N>, RunError<N>> {
        self.differentiated(start, span, self.tangents(parameters))
    }

    fn tangents(&self, parameters: &[usize]) -> Tangents<'m, M, N> {
        let chosen = (self.chosen_element(), self.control);
        Tangents::new(self.model.clone(), chosen, parameters)
    }

    fn differentiated(
        &self,
        start: State<N>,
        span: Range<f64>,
        mut tangents: Tangents<'m, M, N>,
    ) -> Result<Sensitive<N>, RunError<N>> {
        if let Err(kind) = check_kinks::<M, N>(self.at_kinks, "run_sensitive") {
            let motion = Motion::from_start(&*self.model, span.start, &start);
            return Err(RunError::new(kind, motion));
        }
        let motion = self.drive(start, &span, identity, Some(&mut tangents))?;
        Ok(tangents.into_sensitive(motion))
    }
}

/// Derivatives on their way along a run.
pub struct Tangents<'m, M, const N: usize> {
    model: Share<'m, M>,
    chosen: (Element, Control),
    /// The parameters: their indices, and their directions.
    indices: Vec<usize>,
    parameters: Vec<Direction>,
    /// The derivatives at the current state.
    before: Before,
    /// ∂(p, q)/∂(start, parameters) after the action that follows.
    acted: Option<DMatrix<f64>>,
    /// The error of an action that sets a parameter to a value which depends on the state.
    dependent: Option<RunErrorKind>,
    nodes: Vec<Slopes>,
    /// The derivatives along the elements so far, if asked for.
    inside: Option<Vec<Inside>>,
    events: Vec<(usize, Vec<f64>)>,
    /// A stepper for elements that events have cut.
    probe: Option<Stepper<'m, M, N>>,
    /// A basis of the motions that the constraints allow at the point from which derivatives are counted, for models
    /// with constraints; `None` before the first element.
    counted_from: Option<Result<DMatrix<f64>, StepError>>,
}

/// The derivatives over an element.
struct Across {
    /// Of its end.
    end: DMatrix<f64>,
    /// Of its end, in further directions.
    more: DMatrix<f64>,
    /// Along the element, by its start and all directions, if asked for.
    inside: Vec<InsideSlopes>,
}

/// The start of the element moves in time, its end does not.
const START: Direction = Direction {
    time: 1.0,
    length: -1.0,
    parameter: None,
    damping: 0.0,
};

/// Only the end moves in time.
const END: Direction = Direction {
    time: 0.0,
    length: 1.0,
    parameter: None,
    damping: 0.0,
};

impl<'m, M: Model<N>, const N: usize> Tangents<'m, M, N> {
    pub(super) fn new(model: Share<'m, M>, chosen: (Element, Control), indices: &[usize]) -> Self {
        let parameters = directions(&*model, indices);
        let columns = 2 * N + parameters.len();
        Self {
            model,
            chosen,
            indices: indices.to_vec(),
            parameters,
            before: Before {
                state: DMatrix::identity(2 * N, columns),
                start: None,
            },
            acted: None,
            dependent: None,
            nodes: Vec::new(),
            inside: None,
            events: Vec::new(),
            probe: None,
            counted_from: None,
        }
    }

    /// Also keeps the derivatives along elements.
    fn with_inside(self) -> Self {
        Self {
            inside: Some(Vec::new()),
            ..self
        }
    }

    /// Returns the derivatives since the start or the last call, and counts them anew from here.
    pub(super) fn restart(&mut self) -> DMatrix<f64> {
        let columns = self.columns();
        (self.before.start, self.counted_from) = (None, None);
        std::mem::replace(&mut self.before.state, DMatrix::identity(2 * N, columns))
    }

    /// The derivative of the state at an event without action, including its time; derivatives are counted anew from
    /// there.
    pub(super) fn crossed(
        &mut self,
        severed: &Severed<'_, 'm, N>,
    ) -> Result<DMatrix<f64>, TransitionError> {
        let Across {
            end: at,
            more: rate,
            ..
        } = self.up_to(severed)?;
        let times = self.times(severed, (&at, &rate))?;
        // The start of the element, differentiated by the state at the event at a fixed time.
        let back = self.inverse(&at, severed)?;
        if let Some(moved) = &mut self.before.start {
            let row = DMatrix::from_row_slice(1, moved.len(), moved) * &back;
            *moved = row.iter().copied().collect();
        }
        self.before.state = &self.before.state * back;
        let mut matrix = at;
        for (mut column, dt) in matrix.column_iter_mut().zip(&times) {
            column.axpy(*dt, &rate.column(0), 1.0);
        }
        Ok(matrix)
    }

    /// Counts derivatives from this state, if they are not yet counted from an earlier one.
    fn count_from(&mut self, t: f64, state: &State<N>) {
        if const { !M::CONSTRAINTS.is_empty() } && self.counted_from.is_none() {
            self.counted_from = Some(self.basis(t, state));
        }
    }

    /// A basis of the motions that the constraints allow at a state, with the current parameters.
    pub(super) fn basis(&self, t: f64, state: &State<N>) -> Result<DMatrix<f64>, StepError> {
        tangent_basis(&*self.model, t, state)
    }

    /// The inverse of the derivative of the state at an event by that at the previous point. With constraints it acts
    /// on the motions that these allow (T-78); other directions vanish at the event.
    fn inverse(
        &mut self,
        at: &DMatrix<f64>,
        severed: &Severed<'_, 'm, N>,
    ) -> Result<DMatrix<f64>, TransitionError> {
        let inverted = |matrix: DMatrix<f64>| {
            let inverse = matrix.try_inverse();
            inverse.ok_or(TransitionError::from(StepError::NonFinite))
        };
        if const { M::CONSTRAINTS.is_empty() } {
            return inverted(at.clone());
        }
        let event = severed.event;
        let here = self.basis(event.t, &event.state());
        let before = self.counted_from.replace(here.clone());
        let before = before.unwrap_or_else(|| self.basis(severed.start, severed.before));
        let (before, here) = (before?, here?);
        if before.ncols() != here.ncols() {
            return Err(StepError::from(ConstraintError::RankChanged).into());
        }
        let back = inverted(here.tr_mul(&(at * &before)))?;
        Ok(before * (back * here.transpose()))
    }

    /// The derivative of the time of an event by each column, from g(t*, y(t*)) = 0: ġ dt* = −δg. If g has jumped over
    /// zero at the start of an element, by an impulse or an action, the time is that of the start.
    fn times(
        &self,
        severed: &Severed<'_, 'm, N>,
        (at, rate): (&DMatrix<f64>, &DMatrix<f64>),
    ) -> Result<Vec<f64>, TransitionError> {
        /// The least distance of g from zero after a jump, relative to its change in a step.
        const JUMPED: f64 = 1e-6;

        let event = severed.event;
        let state = event.state();
        let place = Place {
            t: event.t,
            state: &state,
            v: &event.v,
        };
        let along = Along::new(&*self.model, place);
        let slope = |change: &Change<N>| {
            let velocity = along.velocity(change);
            let value = &severed.watched.value;
            value.slope(&along, event, change, &velocity)
        };
        let by_time = slope(&Change {
            t: 1.0,
            ..Change::of_column(rate, 0)
        });
        let value = severed.watched.value.at(&*self.model, event);
        if !severed.inside && value.abs() > JUMPED * (severed.step * by_time).abs() {
            let still = || vec![0.0; self.columns()];
            return Ok(self.before.start.clone().unwrap_or_else(still));
        }
        let time = |column| {
            let change = Change {
                parameter: self.parameter(column),
                ..Change::of_column(at, column)
            };
            -slope(&change) / by_time
        };
        let times: Vec<f64> = (0..self.columns()).map(time).collect();
        if times.iter().all(|dt| dt.is_finite()) {
            Ok(times)
        } else {
            Err(StepError::NonFinite.into())
        }
    }

    fn into_sensitive(self, motion: Motion<N>) -> Sensitive<N> {
        let names = self.indices.iter();
        let names = names.map(|index| self.model.parameter_name(*index).to_string());
        let inside = self.inside.unwrap_or_default();
        Sensitive::new(motion, names.collect(), self.nodes, self.events).with_inside(inside)
    }

    fn columns(&self) -> usize {
        self.before.state.ncols()
    }

    /// The index of the parameter of a column; `None` for a column of the start.
    fn parameter(&self, column: usize) -> Option<usize> {
        self.indices.get(column.checked_sub(2 * N)?).copied()
    }

    /// The derivatives over the last element of `stepper`.
    fn across(
        &self,
        stepper: &mut Stepper<'m, M, N>,
        more: &[Direction],
    ) -> Result<Across, TransitionError> {
        let mut directions = self.parameters.clone();
        directions.extend(self.before.start.as_ref().map(|_| START));
        directions.extend_from_slice(more);
        let all = 2 * N + directions.len();
        let mut entries = vec![0.0; 2 * N * all];
        let mut inside = Vec::new();
        match &self.inside {
            Some(_) => stepper.linearise_inside(&directions, &mut entries, &mut inside)?,
            None => stepper.linearise(&directions, &mut entries)?,
        }
        let matrix = DMatrix::from_row_slice(2 * N, all, &entries);
        let more = matrix.columns(all - more.len(), more.len()).into_owned();
        let end = self.before.through(&matrix, None);
        // A product over many elements can overflow although each factor is finite.
        if !end.iter().all(|one| one.is_finite()) {
            return Err(StepError::NonFinite.into());
        }
        Ok(Across { end, more, inside })
    }

    /// Keeps the derivatives along the last element of `stepper`, whose end moves in time as given.
    fn keep(
        &mut self,
        stepper: &Stepper<'m, M, N>,
        (start, end): (f64, f64),
        slopes: Vec<InsideSlopes>,
        ends: Option<&[f64]>,
    ) {
        let Some(mut inside) = self.inside.take() else {
            return;
        };
        let dense = stepper.dense(start, end);
        for (slopes, piece) in slopes.into_iter().zip(dense.pieces()) {
            let times = (piece.start(), piece.end());
            let moved = (self.before.start.is_some() || ends.is_some()).then(|| {
                let still = vec![0.0; self.columns()];
                let starts = self.before.start.as_ref().unwrap_or(&still);
                let starts = RowDVector::from_row_slice(starts);
                let ends = RowDVector::from_row_slice(ends.unwrap_or(&still));
                let at = |t: f64| {
                    let part = (t - start) / (end - start);
                    &starts * (1.0 - part) + &ends * part
                };
                Moved {
                    ends: [at(times.0), at(times.1)],
                    values: piece.coefficients().as_flattened().to_vec(),
                }
            });
            inside.push(Inside {
                times,
                length: piece.length(),
                slopes,
                before: self.before.clone(),
                ends: ends.map(<[f64]>::to_vec),
                moved,
            });
        }
        self.inside = Some(inside);
    }

    /// The derivatives at fixed time at an event that cuts an element, before its action, together with the time
    /// derivative of the state.
    fn up_to(&mut self, severed: &Severed<'_, '_, N>) -> Result<Across, TransitionError> {
        if severed.inside {
            let (element, control) = self.chosen;
            let mut probe = match self.probe.take() {
                Some(probe) => probe,
                None => Stepper::sharing(self.model.clone(), element, control)?,
            };
            let mut state = *severed.before;
            let length = severed.length;
            probe.advance(severed.begin, length, &mut state, severed.impulses)?;
            let found = self.across(&mut probe, &[END]);
            self.probe = Some(probe);
            return found;
        }
        // The start of the element.
        if const { !M::CONSTRAINTS.is_empty() } {
            return Err(TransitionError::NoStep);
        }
        let event = severed.event;
        let (z, mut first) = (
            match M::FORM {
                Form::Lagrangian => &event.v,
                Form::Hamiltonian => &event.p,
            },
            First::ZERO,
        );
        self.model.first(event.t, &event.q, z, &mut first);
        let sign = match M::FORM {
            Form::Lagrangian => 1.0,
            Form::Hamiltonian => -1.0,
        };
        let mut rate = DMatrix::zeros(2 * N, 1);
        for a in 0..N {
            rate[a] = sign * first.q[a] + first.force[a];
            rate[N + a] = event.v[a];
        }
        let mut next = self.before.state.clone();
        if let Some(moved) = &self.before.start {
            // A later start shortens the time to the fixed end.
            for (mut column, dt) in next.column_iter_mut().zip(moved) {
                column.axpy(-dt, &rate.column(0), 1.0);
            }
        }
        Ok(Across {
            end: next,
            more: rate,
            inside: Vec::new(),
        })
    }
}

impl<'m, M: Model<N>, const N: usize> Follow<'m, M, N> for Tangents<'m, M, N> {
    fn passed(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        passed: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        let Across { end, inside, .. } = self.across(stepper, &[])?;
        self.count_from(passed.start, passed.before);
        self.keep(
            stepper,
            (passed.start, passed.start + passed.h),
            inside,
            None,
        );
        (self.before.state, self.before.start) = (end, None);
        Ok(())
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        if !self.indices.is_empty() {
            let call = "run_sensitive";
            return Err(RunErrorKind::SetUnsupported { call });
        }
        if let Some(dependent) = self.dependent.take() {
            return Err(dependent);
        }
        (self.model, self.probe) = (model.clone(), None);
        Ok(())
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        let Across {
            end: mut at,
            more: rate,
            inside,
        } = self.up_to(severed)?;
        self.count_from(severed.start, severed.before);
        let event = severed.event;
        let state = event.state();
        let model = self.model.clone();
        let along = Along::new(
            &*model,
            Place {
                t: event.t,
                state: &state,
                v: &event.v,
            },
        );
        let times = self.times(severed, (&at, &rate))?;
        if let Some(probe) = self.probe.take() {
            let whole = (severed.start, event.t);
            self.keep(&probe, whole, inside, Some(&times));
            self.probe = Some(probe);
        }
        for (mut column, dt) in at.column_iter_mut().zip(&times) {
            column.axpy(*dt, &rate.column(0), 1.0);
        }
        (self.acted, self.dependent) = (None, None);
        if severed.goes_on {
            let acting = Acting {
                model: &*model,
                along: &along,
                severed,
                at: &at,
                rate: &rate,
                times: &times,
            };
            self.acted = Some(acting.after(|column| self.parameter(column))?);
            // If derivatives by parameters are asked for, actions that set parameters have been refused.
            if self.indices.is_empty() {
                self.dependent = acting.dependent();
            }
        }
        self.before.state = at;
        self.events.push((severed.number, times.clone()));
        self.before.start = Some(times);
        Ok(())
    }

    fn acted(&mut self) {
        if let Some(acted) = self.acted.take() {
            self.before.state = acted;
        }
    }

    fn recorded(&mut self, node: &Node<N>) {
        let state = node.state();
        let place = Place {
            t: node.t,
            state: &state,
            v: &node.v,
        };
        let along = Along::new(&*self.model, place);
        let columns = self.columns();
        let mut slopes = Slopes {
            state: self.before.state.clone(),
            velocity: DMatrix::zeros(N, columns),
            outputs: DMatrix::zeros(self.model.columns(), columns),
        };
        for column in 0..columns {
            let change = Change {
                // The time of an event moves, too.
                t: self
                    .before
                    .start
                    .as_ref()
                    .map_or(0.0, |moved| moved[column]),
                parameter: self.parameter(column),
                ..Change::of_column(&self.before.state, column)
            };
            let velocity = along.velocity(&change);
            slopes
                .velocity
                .column_mut(column)
                .copy_from_slice(&velocity);
            if slopes.outputs.nrows() > 0 {
                let outputs = along.outputs(&change, &velocity);
                slopes.outputs.column_mut(column).copy_from_slice(&outputs);
            }
        }
        self.nodes.push(slopes);
    }
}
