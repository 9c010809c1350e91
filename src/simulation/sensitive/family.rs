//! Runs with derivatives by parameters and by the start, for models of run-time length.

use super::super::setup::Simulation;
use super::super::trail::Trail;
use crate::error::RunError;
use crate::length::RunTimeLength;
use crate::sensitivity::Sensitive;
use std::ops::Range;
use tfe_runtime::family::{self, FamilyState};
#[cfg(feature = "sparse")]
use {
    super::super::retrace::Retrace,
    super::super::trail::{Between, Element, Kicked},
    super::carried::{Along, AlongPiece, Carried, Reached},
    crate::error::RunErrorKind,
    crate::motion::Motion,
    crate::sensitivity::inside::Before,
    nalgebra::{DMatrix, DVector},
    tfe_runtime::family::{OperatorError, TransitionOperator},
    tfe_runtime::{InsideSlopes, StepError},
};

impl<'m, M: family::Model> Simulation<'m, M, 0, RunTimeLength> {
    /// Runs over the span as [`run`](Self::run) does, and keeps the derivatives of every recorded node with respect to
    /// all parameters of the model and to the start.
    ///
    /// Parameters are the fields that are numbers, and the elements of fields that are vectors of numbers. Every
    /// element is solved once more with sparse factors, and then once for each number of the start and each parameter.
    /// Each recorded node keeps 2n (2n + parameters) numbers, and as many for velocities and outputs;
    /// [`record_every`](Self::record_every) keeps fewer nodes. The functions given to [`on`](Self::on) are called
    /// several times with nearby states, for differences of sixth order, as for models of fixed size.
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run); [`RunErrorKind::Transition`](crate::RunErrorKind::Transition) if an
    /// event has no derivative; [`RunErrorKind::SetUnsupported`](crate::RunErrorKind::SetUnsupported) if an event
    /// [sets](crate::Act::Set) a parameter. [`RunErrorKind::Unsupported`](crate::RunErrorKind::Unsupported) without the
    /// feature `sparse`, and if steps were so long that they had to be cut.
    #[cfg_attr(feature = "sparse", doc = include_str!("family.md"))]
    pub fn run_sensitive(
        &self,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<Sensitive<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let trail = Trail::with_nodes();
        let (motion, trail) = self.trailed("run_sensitive", start, &span, trail)?;
        #[cfg(feature = "sparse")]
        return self.differentiated(motion, &trail);
        // Such a model was refused above.
        #[cfg(not(feature = "sparse"))]
        {
            drop(trail);
            Ok(Sensitive::new(motion, Vec::new(), Vec::new(), Vec::new()))
        }
    }

    #[cfg(feature = "sparse")]
    fn differentiated(
        &self,
        motion: Motion<0, RunTimeLength>,
        trail: &Trail<'m, M>,
    ) -> Result<Sensitive<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let model = &*self.model;
        let parameters: Vec<usize> = (0..model.parameters()).collect();
        let carrying = Carrying::new(model.len(), &parameters);
        let mut course = Carrier {
            carrying: match self.record_every {
                1 => carrying.with_inside(),
                _ => carrying,
            },
            motion: &motion,
        };
        let done = self.retrace("run_sensitive", trail, &parameters, &mut course);
        let carried = course.carrying.carried;
        if let Err(kind) = done {
            return Err(RunError::new(kind, motion));
        }
        Ok(carried.into_sensitive(motion, |index| model.parameter_name(index)))
    }
}

/// Carries the derivatives by the parameters along a run.
#[cfg(feature = "sparse")]
struct Carrier<'a> {
    carrying: Carrying,
    motion: &'a Motion<0, RunTimeLength>,
}

#[cfg(feature = "sparse")]
impl<'m, M: family::Model> Retrace<'m, M> for Carrier<'_> {
    fn element(
        &mut self,
        _: &M,
        element: &Element,
        transition: &TransitionOperator,
    ) -> Result<(), OperatorError> {
        self.carrying.pass(element, transition)
    }

    fn kicked(&mut self, model: &M, kicked: &Kicked) -> Result<(), OperatorError> {
        self.carrying.kick(model, kicked)
    }

    fn between(&mut self, model: &M, between: &Between<'m, M>) -> Result<(), RunErrorKind> {
        if let Between::Node(number) = between {
            let node = &self.motion.states()[*number];
            self.carrying.carried.recorded(model, node);
        }
        self.carrying.between(model, between)
    }
}

/// Carries derivatives over the elements of a trail and over the events between them.
#[cfg(feature = "sparse")]
pub(in crate::simulation) struct Carrying {
    pub(in crate::simulation) carried: Carried,
    /// The derivatives at the event that ends the last element, and those along that element, if they are kept.
    cut: Option<(Reached, Option<Along>)>,
}

#[cfg(feature = "sparse")]
impl Carrying {
    /// The derivatives at the start of a run, by the start and by parameters of given indices.
    pub(in crate::simulation) fn new(coordinates: usize, parameters: &[usize]) -> Self {
        Self {
            carried: Carried::new(coordinates, parameters),
            cut: None,
        }
    }

    fn with_inside(self) -> Self {
        Self {
            carried: self.carried.with_inside(),
            ..self
        }
    }

    /// Carries the derivatives over impulses on a model with constraints.
    pub(in crate::simulation) fn kick<M: family::Model>(
        &mut self,
        model: &M,
        kicked: &Kicked,
    ) -> Result<(), OperatorError> {
        let kick = family::Kick::of(model, kicked.t, &kicked.with, self.carried.indices())?;
        let state = &mut self.carried.before.state;
        let size = state.nrows();
        for mut column in state.column_iter_mut() {
            kick.apply(column.as_mut_slice());
        }
        let by_parameters = kick.by_parameters().iter();
        for (by, mut column) in by_parameters.zip(state.column_iter_mut().skip(size)) {
            let mut of_p = column.rows_mut(0, size / 2);
            of_p += DVector::from_column_slice(by);
        }
        Ok(())
    }

    /// Carries the derivatives over an element.
    pub(in crate::simulation) fn pass(
        &mut self,
        element: &Element,
        transition: &TransitionOperator,
    ) -> Result<(), OperatorError> {
        let Before { state, .. } = &self.carried.before;
        let (size, columns) = state.shape();
        let keeps = self.carried.keeps_inside();
        let mut next = DMatrix::zeros(size, columns);
        let mut along = Vec::new();
        for (from, mut to) in state.column_iter().zip(next.column_iter_mut()) {
            let from: Vec<f64> = from.iter().copied().collect();
            let (mut end, mut own) = (vec![0.0; size], Vec::new());
            transition.apply_inside(&from, &mut end, keeps.then_some(&mut own))?;
            to.copy_from_slice(&end);
            along.extend(own);
        }
        self.add_direct(element, transition.by_parameters(), &mut next);
        // A product over many elements can overflow although each factor is finite.
        if !next.iter().all(|one| one.is_finite()) {
            return Err(StepError::NonFinite.into());
        }
        let along = keeps.then(|| {
            let mut slopes = DMatrix::from_vec(along.len() / columns, columns, along);
            self.add_direct(element, transition.inside_by_parameters(), &mut slopes);
            self.along(element, transition, slopes)
        });
        let (_, ends) = element.moves;
        let rate = transition.by_parameters().last().filter(|_| ends);
        if let Some(rate) = rate {
            let rate = DMatrix::from_column_slice(size, 1, rate);
            self.cut = Some((Reached { at: next, rate }, along));
            return Ok(());
        }
        if let Some(along) = along {
            self.carried.keep(along, None);
        }
        self.carried.passed(next);
        Ok(())
    }

    /// Adds the derivatives by parameters, and those by the start time of the element if an event moves it.
    fn add_direct(&self, element: &Element, by: &[Vec<f64>], to: &mut DMatrix<f64>) {
        let Before { state, start } = &self.carried.before;
        let count = self.carried.indices().len();
        let parameters = to.column_iter_mut().skip(state.nrows());
        for (by, mut to) in by.iter().take(count).zip(parameters) {
            to += DVector::from_column_slice(by);
        }
        let start = start.as_ref().filter(|_| element.moves.0);
        let Some((by, times)) = by.get(count).zip(start) else {
            return;
        };
        let by = DVector::from_column_slice(by);
        for (dt, mut to) in times.iter().zip(to.column_iter_mut()) {
            to.axpy(*dt, &by, 1.0);
        }
    }

    /// The derivatives along an element, from those of the coefficients of its polynomials; with a column for the time of
    /// its end if an event moves it.
    fn along(
        &self,
        element: &Element,
        transition: &TransitionOperator,
        mut slopes: DMatrix<f64>,
    ) -> Along {
        let mut start = self.carried.before.state.clone();
        let (size, columns) = start.shape();
        let (_, ends) = element.moves;
        if let Some(by_end) = transition.inside_by_parameters().last().filter(|_| ends) {
            slopes = slopes.insert_column(columns, 0.0);
            slopes.column_mut(columns).copy_from_slice(by_end);
            start = start.insert_column(columns, 0.0);
        }
        let rows = |matrix: &DMatrix<f64>| matrix.transpose().as_slice().to_vec();
        let piece = AlongPiece {
            times: element.nodes,
            length: element.h,
            slopes: InsideSlopes {
                ends: <[Vec<f64>; 2]>::default(),
                start: rows(&start),
                coefficients: rows(&slopes),
            },
            values: transition.dense().coefficients(),
        };
        Along {
            times: element.nodes,
            pieces: vec![piece],
            before: Before {
                state: DMatrix::identity(size, columns),
                start: None,
            },
        }
    }

    /// Processes a record between elements.
    pub(in crate::simulation) fn between<M: family::Model>(
        &mut self,
        model: &M,
        between: &Between<'_, M>,
    ) -> Result<(), RunErrorKind> {
        match between {
            Between::Node(_) | Between::Kicked(_) => {}
            Between::Acted => self.carried.acted(),
            Between::Set(_) => return self.carried.set(),
            Between::Cut(cut) => {
                let severed = cut.severed();
                let solved = self.cut.take();
                let (reached, along) =
                    solved.unwrap_or_else(|| (self.carried.at_start(model, severed.event), None));
                let done = self.carried.cut(model, &severed, reached, along);
                return done.map_err(|source| RunErrorKind::Transition {
                    element: cut.element,
                    time: severed.start,
                    step: severed.length,
                    source,
                });
            }
        }
        Ok(())
    }
}
