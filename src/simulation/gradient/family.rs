//! The same for models of run-time length.

use super::super::setup::Simulation;
use super::super::trail::Trail;
use crate::error::RunError;
use crate::length::RunTimeLength;
use crate::motion::Motion;
use crate::sensitivity::{Loss, LossGradient};
use std::ops::Range;
use tfe_runtime::family::{self, FamilyState};
#[cfg(feature = "sparse")]
use {
    super::super::linearise::family::operator_failed, super::view::View, crate::error::RunErrorKind,
};

/// Why there is no gradient.
#[cfg(feature = "sparse")]
enum Failure {
    /// An element has none.
    Element(family::OperatorError),
    /// The loss has none.
    Loss(RunErrorKind),
}

#[cfg(feature = "sparse")]
impl From<family::OperatorError> for Failure {
    fn from(error: family::OperatorError) -> Self {
        Self::Element(error)
    }
}

#[cfg(feature = "sparse")]
impl From<RunErrorKind> for Failure {
    fn from(kind: RunErrorKind) -> Self {
        Self::Loss(kind)
    }
}

impl<'m, M: family::Model> Simulation<'m, M, 0, RunTimeLength> {
    /// Runs over the span as [`run`](Self::run) does, and gives a loss of the motion with its gradient by all parameters of the model and by the start, in one pass backwards.
    ///
    /// Every element is solved once more, from where it began; memory beside that of all nodes is linear in the number of coordinates where the equations are M q̈ = f with a constant diagonal M
    /// (T-150), and so is the time. Functions of nodes of models of run-time length are [`Loss::of_end`].
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run); [`RunErrorKind::NoOutput`](crate::RunErrorKind::NoOutput) and [`RunErrorKind::Loss`](crate::RunErrorKind::Loss) for a loss that does not belong to the model
    /// and the span. [`RunErrorKind::Unsupported`](crate::RunErrorKind::Unsupported) without the feature `sparse`, for models with constraints, for events that change the state or end the run, and where
    /// steps were so long that they were cut.
    #[cfg_attr(feature = "sparse", doc = include_str!("family.md"))]
    pub fn gradient(
        &self,
        start: FamilyState,
        span: Range<f64>,
        loss: &Loss<'_, 0, RunTimeLength>,
    ) -> Result<(f64, LossGradient<0, RunTimeLength>), RunError<0, RunTimeLength>> {
        // Of a model that does not fit together there are no columns; the run says why.
        if self.model.check().is_ok() {
            let outputs = (0..self.model.columns()).map(|at| self.model.column_name(at));
            let outputs: Vec<_> = outputs.collect();
            if let Err(kind) = loss.check(&outputs, (span.start, span.end)) {
                return Err(RunError::new(kind, Motion::unasked(span.start, &start)));
            }
        }
        let mut run = self.clone().record_every(1);
        run.breaks.extend(loss.nodes());
        let (motion, trail) = run.trailed("gradient", start, &span, Trail::default())?;
        #[cfg(feature = "sparse")]
        return run.pulled(motion, &trail, loss);
        // Refused before.
        #[cfg(not(feature = "sparse"))]
        {
            drop(trail);
            let by_start = vec![0.0; 2 * self.model.len()];
            Ok((
                f64::NAN,
                LossGradient::new(motion, Vec::new(), Vec::new(), &by_start),
            ))
        }
    }

    #[cfg(feature = "sparse")]
    fn pulled(
        &self,
        motion: Motion<0, RunTimeLength>,
        trail: &Trail,
        loss: &Loss<'_, 0, RunTimeLength>,
    ) -> Result<(f64, LossGradient<0, RunTimeLength>), RunError<0, RunTimeLength>> {
        let (value, seen) = match loss.seen(&motion, &*self.model) {
            Ok(seen) => seen,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let elements = &trail.elements;
        let mut number = elements.len();
        let mut view = View::new(&*self.model, &seen, &motion.last().v);
        let mut pulled = || -> Result<_, Failure> {
            let element = self.chosen_element();
            let mut backwards = family::Backwards::new(&*self.model, element, self.control)?;
            loop {
                let node = &motion.states()[number];
                if let Some(partials) = view.of_node(number) {
                    let state = node.state();
                    backwards.see(node.t, (&state, &node.v), &partials)?;
                }
                let Some(before) = number.checked_sub(1) else {
                    return Ok(backwards);
                };
                number = before;
                let element = &elements[number];
                let inside = view.of_element(&mut backwards, &motion.elements()[number])?;
                let place = (element.t, element.h);
                let end = backwards.pass(place, &element.before, inside.first())?;
                element.check(&end)?;
            }
        };
        match pulled() {
            Ok(backwards) => {
                let names = 0..self.model.parameters();
                let names = names.map(|at| self.model.parameter_name(at).to_string());
                let by_parameters = backwards.by_parameters();
                let by_start = backwards.by_state();
                let gradient = LossGradient::new(motion, names.collect(), by_parameters, by_start);
                Ok((value, gradient))
            }
            Err(Failure::Element(error)) => {
                let element = elements.get(number).map(|element| (number, element));
                let kind = operator_failed(error, element, "gradient");
                Err(RunError::new(kind, motion))
            }
            Err(Failure::Loss(kind)) => Err(RunError::new(kind, motion)),
        }
    }
}
