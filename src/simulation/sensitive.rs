//! Runs with derivatives by parameters and by the start (T-123, T-124).

mod acts;
pub(super) mod carried;
pub(super) mod family;
pub(super) mod jump;
#[cfg(feature = "sparse")]
pub(super) mod transposed;

use super::events::Severed;
use super::follow::{Follow, Passed};
use super::kind::Chosen;
use super::setup::Simulation;
use crate::constraints::tangent_basis;
use crate::error::{RunError, RunErrorKind};
use crate::motion::{Motion, Node};
use crate::sensitivity::Sensitive;
use crate::sensitivity::inside::Before;
use crate::sensitivity::slopes::directions;
use carried::{Along, Carried, Reached};
use jump::Jump;
use nalgebra::DMatrix;
use std::convert::identity;
use std::ops::Range;
use tfe_runtime::step::Stepper;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{ConstraintError, Direction, InsideSlopes, Model, Share, State, StepError};

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
    /// derivative, [`RunErrorKind::SetUnsupported`] if an event [sets](crate::Act::Set) a parameter.
    pub fn run_sensitive(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Sensitive<N>, RunError<N>> {
        let all: Vec<_> = (0..self.model.parameters()).collect();
        let run = self.cut_at_kinks();
        let tangents = run.tangents(&all);
        match run.record_every {
            1 => run.differentiated(start, span, tangents.with_inside()),
            _ => run.differentiated(start, span, tangents),
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
        let run = self.cut_at_kinks();
        let tangents = run.tangents(parameters);
        run.differentiated(start, span, tangents)
    }

    fn tangents(&self, parameters: &[usize]) -> Tangents<'m, M, N> {
        Tangents::new(self.model.clone(), self.chosen(), parameters)
    }

    fn differentiated(
        &self,
        start: State<N>,
        span: Range<f64>,
        mut tangents: Tangents<'m, M, N>,
    ) -> Result<Sensitive<N>, RunError<N>> {
        let mut motion = self.drive(start, &span, identity, Some(&mut tangents))?;
        self.warn_of_kinks(&mut motion);
        Ok(tangents.into_sensitive(motion))
    }
}

/// Derivatives on their way along a run.
pub struct Tangents<'m, M, const N: usize> {
    model: Share<'m, M>,
    chosen: Chosen,
    /// The parameters, as directions.
    parameters: Vec<Direction>,
    carried: Carried,
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

impl Across {
    /// From the derivatives of the end, in rows: by the start, and in directions of which the last `more` are further
    /// ones. `before` are the derivatives of the start.
    fn of(
        before: &Before,
        entries: &[f64],
        more: usize,
        inside: Vec<InsideSlopes>,
    ) -> Result<Self, TransitionError> {
        let size = before.state.nrows();
        let all = entries.len() / size;
        let matrix = DMatrix::from_row_slice(size, all, entries);
        let more = matrix.columns(all - more, more).into_owned();
        let end = before.through(&matrix, None);
        // A product over many elements can overflow although each factor is finite.
        if !end.iter().all(|one| one.is_finite()) {
            return Err(StepError::NonFinite.into());
        }
        Ok(Self { end, more, inside })
    }
}

impl<'m, M: Model<N>, const N: usize> Tangents<'m, M, N> {
    pub(super) fn new(model: Share<'m, M>, chosen: Chosen, indices: &[usize]) -> Self {
        Self {
            parameters: directions(&*model, indices),
            carried: Carried::new(N, indices),
            model,
            chosen,
            probe: None,
            counted_from: None,
        }
    }

    /// Also keeps the derivatives along elements.
    fn with_inside(self) -> Self {
        Self {
            carried: self.carried.with_inside(),
            ..self
        }
    }

    /// Returns the derivatives since the start or the last call, and counts them anew from here.
    pub(super) fn restart(&mut self) -> DMatrix<f64> {
        self.counted_from = None;
        self.carried.restart()
    }

    /// The derivative of the state at an event without action, including its time; derivatives are counted anew from
    /// there.
    pub(super) fn crossed(
        &mut self,
        severed: &Severed<'_, 'm, N>,
    ) -> Result<DMatrix<f64>, TransitionError> {
        let (reached, _) = self.up_to(severed)?;
        let model = self.model.clone();
        let event = severed.event;
        let node = Node::of(event.t, &event.state(), event.v);
        let jump = Jump::at(&*model, severed, &node, &reached.rate);
        let times = self.carried.times(&jump, &reached.at)?;
        let Reached { at, rate } = reached;
        // The start of the element, differentiated by the state at the event at a fixed time.
        let back = self.inverse(&at, severed)?;
        let before = &mut self.carried.before;
        if let Some(moved) = &mut before.start {
            let row = DMatrix::from_row_slice(1, moved.len(), moved) * &back;
            *moved = row.iter().copied().collect();
        }
        before.state = &before.state * back;
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

    fn into_sensitive(self, motion: Motion<N>) -> Sensitive<N> {
        let model = self.model;
        (self.carried).into_sensitive(motion, |index| model.parameter_name(index))
    }

    /// The derivatives over the last element of `stepper`.
    fn across(
        &self,
        stepper: &mut Stepper<'m, M, N>,
        more: &[Direction],
    ) -> Result<Across, TransitionError> {
        let mut directions = self.parameters.clone();
        let before = &self.carried.before;
        directions.extend(before.start.as_ref().map(|_| Direction::START));
        directions.extend_from_slice(more);
        let all = 2 * N + directions.len();
        let mut entries = vec![0.0; 2 * N * all];
        let mut inside = Vec::new();
        match self.carried.keeps_inside() {
            true => stepper.linearise_inside(&directions, &mut entries, &mut inside)?,
            false => stepper.linearise(&directions, &mut entries)?,
        }
        Across::of(before, &entries, more.len(), inside)
    }

    /// The derivatives along the last element of `stepper`.
    fn along(
        &self,
        stepper: &Stepper<'m, M, N>,
        times: (f64, f64),
        inside: Vec<InsideSlopes>,
    ) -> Along {
        let dense = stepper.dense(times.0, times.1);
        Along::of(&dense, times, inside, &self.carried.before)
    }

    /// The derivatives at an event that cuts an element, before its action, and those along the part of the element
    /// before the event; the latter are `None` for an event at the start of the element.
    fn up_to(
        &mut self,
        severed: &Severed<'_, '_, N>,
    ) -> Result<(Reached, Option<Vec<InsideSlopes>>), TransitionError> {
        if severed.inside {
            let mut probe = match self.probe.take() {
                Some(probe) => probe,
                None => {
                    let Chosen {
                        element, control, ..
                    } = self.chosen;
                    let probe = Stepper::sharing(self.model.clone(), element, control)?;
                    match self.chosen.at_kinks {
                        true => probe.at_kinks(),
                        false => probe,
                    }
                }
            };
            let mut state = *severed.before;
            let length = severed.length;
            probe.advance(severed.begin, length, &mut state, severed.impulses)?;
            let found = self.across(&mut probe, &[Direction::END]);
            self.probe = Some(probe);
            let Across { end, more, inside } = found?;
            let reached = Reached {
                at: end,
                rate: more,
            };
            return Ok((reached, Some(inside)));
        }
        // The start of the element.
        Ok((self.carried.at_start(&*self.model, severed.event), None))
    }
}

impl<'m, M: Model<N>, const N: usize> Follow<'m, M, N> for Tangents<'m, M, N> {
    fn passed(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        passed: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        let Across { end, inside, .. } = self.across(stepper, &[])?;
        self.count_from(passed.t, passed.before);
        if self.carried.keeps_inside() {
            let times = (passed.t, passed.t + passed.h);
            let along = self.along(stepper, times, inside);
            self.carried.keep(along, None);
        }
        self.carried.passed(end);
        Ok(())
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        self.carried.set()?;
        (self.model, self.probe) = (model.clone(), None);
        Ok(())
    }

    fn cut(&mut self, severed: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        let (reached, inside) = self.up_to(severed)?;
        self.count_from(severed.start, severed.before);
        let model = self.model.clone();
        let inside = inside.filter(|_| self.carried.keeps_inside());
        let times = (severed.start, severed.event.t);
        let solved = self.probe.as_ref().zip(inside);
        let along = solved.map(|(probe, inside)| self.along(probe, times, inside));
        self.carried.cut(&*model, severed, reached, along)
    }

    fn acted(&mut self) {
        self.carried.acted();
    }

    fn recorded(&mut self, node: &Node<N>) {
        self.carried.recorded(&*self.model, node);
    }
}
