//! Gradients of losses by the adjoint method, for models of run-time length.

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
    super::super::mesh::within, super::super::retrace::operator_failed,
    super::super::trail::is_same, super::view::View, crate::error::RunErrorKind,
    crate::sensitivity::loss::Seen, std::convert::identity,
};

/// Why there is no gradient.
#[cfg(feature = "sparse")]
enum Failure {
    /// An element has no derivative.
    Element(family::OperatorError),
    /// The loss has no derivative.
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
    /// Runs over the span as [`run`](Self::run) does, and returns a loss of the motion with its gradient with respect
    /// to all parameters of the model and to the start, in one pass backwards (adjoint method, T-150).
    ///
    /// Every element is solved once more from its recorded start. Besides the nodes, time and memory are linear in the
    /// number of coordinates if the equations are M q̈ = f with a constant diagonal mass matrix M. A loss that is a
    /// function of nodes is given by [`Loss::of_end`].
    ///
    /// With [`record_every`](Self::record_every) only every k-th node is kept, and the motion between two of these is
    /// computed again on the way back: about k + n/k of n nodes are in memory, for the time of one more run.
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run). [`RunErrorKind::NoOutput`](crate::RunErrorKind::NoOutput) or
    /// [`RunErrorKind::Loss`](crate::RunErrorKind::Loss) if the loss does not fit the model or the span.
    /// [`RunErrorKind::Unsupported`](crate::RunErrorKind::Unsupported) without the feature `sparse`, for events that
    /// change the state or end the run, and if steps were so long that they had to be cut.
    #[cfg_attr(feature = "sparse", doc = include_str!("family.md"))]
    pub fn gradient(
        &self,
        start: FamilyState,
        span: Range<f64>,
        loss: &Loss<'_, 0, RunTimeLength>,
    ) -> Result<(f64, LossGradient<0, RunTimeLength>), RunError<0, RunTimeLength>> {
        // A model with inconsistent lengths has no outputs here; the run reports the error.
        if self.model.check().is_ok() {
            let outputs = (0..self.model.columns()).map(|at| self.model.column_name(at));
            let outputs: Vec<_> = outputs.collect();
            if let Err(kind) = loss.check(&outputs, (span.start, span.end)) {
                return Err(RunError::new(kind, Motion::unasked(span.start, &start)));
            }
        }
        let mut run = self.clone();
        run.look_at(loss, &span);
        #[cfg(feature = "sparse")]
        if self.record_every > 1 && self.events.is_empty() {
            let found = run.by_checkpoints(&start, &span, loss)?;
            if let Some(found) = found {
                return Ok(found);
            }
        }
        let run = run.record_every(1);
        let (motion, trail) = run.trailed("gradient", start, &span, Trail::new())?;
        #[cfg(feature = "sparse")]
        return run.pulled(motion, &trail, loss);
        // Such a model was refused above.
        #[cfg(not(feature = "sparse"))]
        {
            drop(trail);
            let by_start = vec![0.0; 2 * self.model.len()];
            let gradient = LossGradient::new(motion, Vec::new(), Vec::new(), &by_start)?;
            Ok((f64::NAN, gradient))
        }
    }

    #[cfg(feature = "sparse")]
    fn pulled(
        &self,
        motion: Motion<0, RunTimeLength>,
        trail: &Trail<'m, M>,
        loss: &Loss<'_, 0, RunTimeLength>,
    ) -> Result<(f64, LossGradient<0, RunTimeLength>), RunError<0, RunTimeLength>> {
        let (value, seen) = match loss.seen(&motion, &*self.model) {
            Ok(seen) => seen,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let backwards = self.backwards();
        let gone = backwards.and_then(|mut backwards| {
            self.back(&mut backwards, (&motion, trail), &seen)?;
            Ok(backwards)
        });
        match gone {
            Ok(backwards) => Ok((value, self.gathered(motion, &backwards)?)),
            Err(kind) => Err(RunError::new(kind, motion)),
        }
    }

    /// The same between recorded nodes, where the run is repeated; `None` if it then ends elsewhere, or has no
    /// derivatives.
    #[cfg(feature = "sparse")]
    fn by_checkpoints(
        &self,
        start: &FamilyState,
        span: &Range<f64>,
        loss: &Loss<'_, 0, RunTimeLength>,
    ) -> Result<Option<(f64, LossGradient<0, RunTimeLength>)>, RunError<0, RunTimeLength>> {
        let motion = self.drive(start.clone(), span, identity, None)?;
        match self.descended(&motion, span, loss) {
            Ok(Some((value, backwards))) => {
                let gradient = self.gathered(motion, &backwards)?;
                Ok(Some((value, gradient)))
            }
            Ok(None) => Ok(None),
            Err(kind) => Err(RunError::new(kind, motion)),
        }
    }

    #[cfg(feature = "sparse")]
    fn descended(
        &self,
        motion: &Motion<0, RunTimeLength>,
        span: &Range<f64>,
        loss: &Loss<'_, 0, RunTimeLength>,
    ) -> Result<Option<(f64, family::Backwards<'_, M>)>, RunErrorKind> {
        let mesh = self.mesh(span)?;
        let times: Vec<f64> = mesh.elements().map(|(_, next, _)| next).collect();
        let segments = times.len().div_ceil(self.record_every);
        let is_plain = segments > 0 && motion.states().len() == segments + 1;
        let statistics = motion.statistics();
        if statistics.cuts > 0 || statistics.kinks > 0 || !is_plain {
            return Ok(None);
        }
        let mut backwards = self.backwards()?;
        let mut sum = 0.0;
        for (segment, times) in times.chunks(self.record_every).enumerate().rev() {
            let [before, after] = [segment, segment + 1].map(|node| &motion.states()[node]);
            let is_last = segment + 1 == segments;
            let part = loss.part((before.t, after.t), (segment == 0, is_last));
            let mut run = self.clone().record_every(1);
            run.nodes = Some([&[before.t], times].concat());
            // A sample at a node belongs to the element that starts there; at the end of the run, to the last element.
            let (from, to) = (before.t, after.t);
            run.impulses
                .retain(|(t, _)| within(*t, from, to) || (is_last && *t == to));
            let again = run.trailed(
                "gradient",
                before.state(),
                &(before.t..after.t),
                Trail::new(),
            );
            let Ok((again, trail)) = again else {
                return Ok(None);
            };
            let ends = (&before.state(), &after.state());
            let (place, tolerance) = ((from, to - from), self.control.tolerance);
            let end = again.last().state();
            if !is_same::<M, 0, RunTimeLength>(&*self.model, place, &end, ends, tolerance) {
                return Ok(None);
            }
            let (value, seen) = part.seen(&again, &*self.model)?;
            sum += value;
            self.back(&mut backwards, (&again, &trail), &seen)?;
        }
        Ok(Some((sum, backwards)))
    }

    #[cfg(feature = "sparse")]
    fn backwards(&self) -> Result<family::Backwards<'_, M>, RunErrorKind> {
        let element = self.chosen_element();
        let made = family::Backwards::new(&*self.model, element, self.control);
        made.map_err(|error| operator_failed(error, None, "gradient"))
    }

    /// Passes backward over a motion.
    #[cfg(feature = "sparse")]
    fn back(
        &self,
        backwards: &mut family::Backwards<'_, M>,
        (motion, trail): (&Motion<0, RunTimeLength>, &Trail<'m, M>),
        seen: &Seen,
    ) -> Result<(), RunErrorKind> {
        let mut view = View::new(&*self.model, seen, &motion.last().v);
        let elements = &trail.elements;
        let mut number = elements.len();
        let mut go = || -> Result<(), Failure> {
            loop {
                let node = &motion.states()[number];
                if let Some(partials) = view.of_node(number) {
                    let state = node.state();
                    backwards.see(node.t, (&state, &node.v), &partials)?;
                }
                let Some(before) = number.checked_sub(1) else {
                    return Ok(());
                };
                number = before;
                let element = &elements[number];
                let inside = view.of_element(backwards, &motion.elements()[number])?;
                let place = (element.t, element.h);
                let end = backwards.pass(place, &element.before, inside.first())?;
                element.check(&*self.model, &end, self.control.tolerance)?;
                if let Some(kicked) = &element.kicked {
                    backwards.kick(element.t, &kicked.with)?;
                }
            }
        };
        go().map_err(|failure| match failure {
            Failure::Element(error) => {
                let element = elements.get(number);
                operator_failed(error, element, "gradient")
            }
            Failure::Loss(kind) => kind,
        })
    }

    #[cfg(feature = "sparse")]
    fn gathered(
        &self,
        motion: Motion<0, RunTimeLength>,
        backwards: &family::Backwards<'_, M>,
    ) -> Result<LossGradient<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let names = 0..self.model.parameters();
        let names = names.map(|at| self.model.parameter_name(at).to_string());
        let (by_parameters, by_start) = (backwards.by_parameters(), backwards.by_state());
        LossGradient::new(motion, names.collect(), by_parameters, by_start)
    }
}
