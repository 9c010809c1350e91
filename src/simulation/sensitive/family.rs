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
    super::super::linearise::family::operator_failed,
    crate::motion::{Motion, Node},
    crate::sensitivity::Slopes,
    crate::sensitivity::inside::Inside,
    crate::sensitivity::run_time::Along,
    nalgebra::{DMatrix, DVector},
    tfe_runtime::StepError,
};

impl<'m, M: family::Model> Simulation<'m, M, 0, RunTimeLength> {
    /// Runs over the span as [`run`](Self::run) does, and keeps the derivatives of every recorded node with respect to
    /// all parameters of the model and to the start.
    ///
    /// Parameters are the fields that are numbers, and the elements of fields that are vectors of numbers. Every
    /// element is solved once more with sparse factors, and then once for each number of the start and each parameter.
    /// Each recorded node keeps 2n (2n + parameters) numbers, and as many for velocities and outputs;
    /// [`record_every`](Self::record_every) keeps fewer nodes.
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run). [`RunErrorKind::Unsupported`](crate::RunErrorKind::Unsupported)
    /// without the feature `sparse`, for events that change the state or end the run, and if steps were so long that
    /// they had to be cut.
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
        trail: &Trail,
    ) -> Result<Sensitive<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let model = &*self.model;
        let parameters: Vec<usize> = (0..model.parameters()).collect();
        let size = 2 * model.len();
        let mut current = DMatrix::identity(size, size + parameters.len());
        let mut nodes = trail.nodes.iter().peekable();
        let mut slopes = Vec::with_capacity(trail.nodes.len());
        let mut record = |passed: usize, current: &DMatrix<f64>| {
            while let Some((_, node)) = nodes.next_if(|(own, _)| *own == passed) {
                slopes.push(slopes_at(model, node, current));
            }
        };
        record(0, &current);
        let keeps = self.record_every == 1;
        let mut inside = Vec::new();
        let mut passed = 0;
        let each = |transition: family::TransitionOperator| {
            let element = &trail.elements[passed];
            element.check(transition.end(), self.control.tolerance)?;
            if let Some(kicked) = &element.kicked {
                let kick = family::Kick::of(model, element.t, &kicked.with, &parameters)?;
                for mut column in current.column_iter_mut() {
                    kick.apply(column.as_mut_slice());
                }
                let by_parameters = kick.by_parameters().iter();
                for (by, mut column) in by_parameters.zip(current.column_iter_mut().skip(size)) {
                    let mut of_p = column.rows_mut(0, size / 2);
                    of_p += DVector::from_column_slice(by);
                }
            }
            let mut next = DMatrix::zeros(current.nrows(), current.ncols());
            let mut along = Vec::new();
            for (from, mut to) in current.column_iter().zip(next.column_iter_mut()) {
                let from: Vec<f64> = from.iter().copied().collect();
                let (mut end, mut own) = (vec![0.0; size], Vec::new());
                transition.apply_inside(&from, &mut end, keeps.then_some(&mut own))?;
                to.copy_from_slice(&end);
                along.extend(own);
            }
            for (by, mut to) in transition
                .by_parameters()
                .iter()
                .zip(next.column_iter_mut().skip(size))
            {
                to += DVector::from_column_slice(by);
            }
            // A product over many elements can overflow although each factor is finite.
            if !next.iter().all(|one| one.is_finite()) {
                return Err(StepError::NonFinite.into());
            }
            if keeps {
                let rows = along.len() / current.ncols();
                let mut along = DMatrix::from_vec(rows, current.ncols(), along);
                let by_parameters = transition.inside_by_parameters().iter();
                for (by, mut to) in by_parameters.zip(along.column_iter_mut().skip(size)) {
                    to += DVector::from_column_slice(by);
                }
                let times = (element.t, element.t + element.h);
                inside.push(Inside::whole(times, element.h, &current, &along));
            }
            current = next;
            passed += 1;
            record(passed, &current);
            Ok(())
        };
        let steps = trail.elements.iter();
        let steps = steps.map(|element| (element.t, element.h, &element.before));
        let asked = (0.0, &parameters[..]);
        let element = self.chosen_element();
        let found = family::TransitionOperator::of_steps_by(model, element, asked, steps, each);
        if let Err((number, error)) = found {
            let element = Some((number, &trail.elements[number]));
            let kind = operator_failed(error, element, "run_sensitive");
            return Err(RunError::new(kind, motion));
        }
        let names = parameters.iter();
        let names = names.map(|index| model.parameter_name(*index).to_string());
        let sensitive = Sensitive::new(motion, names.collect(), slopes, Vec::new());
        Ok(sensitive.with_inside(inside))
    }
}

/// The derivatives at a node, from those of its state.
#[cfg(feature = "sparse")]
fn slopes_at<M: family::Model>(
    model: &M,
    node: &Node<0, RunTimeLength>,
    current: &DMatrix<f64>,
) -> Slopes {
    let along = Along::new(model, node);
    let (n, columns) = (model.len(), current.ncols());
    let mut slopes = Slopes {
        state: current.clone(),
        velocity: DMatrix::zeros(n, columns),
        outputs: DMatrix::zeros(model.columns(), columns),
    };
    for (column, change) in current.column_iter().enumerate() {
        let change: Vec<f64> = change.iter().copied().collect();
        let (velocity, outputs) = along.slopes(&change, column.checked_sub(2 * n));
        slopes
            .velocity
            .column_mut(column)
            .copy_from_slice(&velocity);
        slopes.outputs.column_mut(column).copy_from_slice(&outputs);
    }
    slopes
}
