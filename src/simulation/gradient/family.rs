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
    super::super::mesh::within, super::super::trail::is_same, super::backward::Backward,
    crate::error::RunErrorKind, std::convert::identity,
};

impl<'m, M: family::Model> Simulation<'m, M, 0, RunTimeLength> {
    /// Runs over the span as [`run`](Self::run) does, and returns a loss of the motion with its gradient with respect
    /// to all parameters of the model and to the start, in one pass backwards (adjoint method, T-150).
    ///
    /// Every element is solved once more from its recorded start. Besides the nodes, time and memory are linear in the
    /// number of coordinates if the equations are M q̈ = f with a constant diagonal mass matrix M. A loss that is a
    /// function of nodes is given by [`Loss::of_end`].
    ///
    /// With [`record_every`](Self::record_every) only every k-th node is kept, and the motion between two of these is
    /// computed again on the way back: about k + n/k of n nodes are in memory, for the time of one more run. Runs with
    /// [events](Self::on) keep all nodes.
    ///
    /// At an event that changes the state the gradient includes the change of the state and that of the time of the
    /// event. The functions given to `on` are then called some 24 times for each coordinate and 12 times for each
    /// parameter, with nearby states, for differences of sixth order; the elements beside such an event are solved with
    /// sparse factors.
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run). [`RunErrorKind::NoOutput`](crate::RunErrorKind::NoOutput) or
    /// [`RunErrorKind::Loss`](crate::RunErrorKind::Loss) if the loss does not fit the model or the span.
    /// [`RunErrorKind::Transition`](crate::RunErrorKind::Transition) if an event has no derivative,
    /// [`RunErrorKind::SetUnsupported`](crate::RunErrorKind::SetUnsupported) if an event [sets](crate::Act::Set) a
    /// parameter. [`RunErrorKind::Unsupported`](crate::RunErrorKind::Unsupported) without the feature `sparse`, and if
    /// steps were so long that they had to be cut.
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
        let (motion, trail) = run.trailed("gradient", start, &span, Trail::with_nodes())?;
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
        let gone = self.backward().and_then(|mut backward| {
            backward.pass((&motion, trail), &seen)?;
            Ok(backward)
        });
        match gone {
            Ok(backward) => Ok((value, self.gathered(motion, &backward)?)),
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
            Ok(Some((value, backward))) => {
                let gradient = self.gathered(motion, &backward)?;
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
    ) -> Result<Option<(f64, Backward<'_, M>)>, RunErrorKind> {
        let mesh = self.mesh(span)?;
        let times: Vec<f64> = mesh.elements().map(|(_, next, _)| next).collect();
        let segments = times.len().div_ceil(self.record_every);
        let is_plain = segments > 0 && motion.states().len() == segments + 1;
        let statistics = motion.statistics();
        if statistics.cuts > 0 || statistics.kinks > 0 || !is_plain {
            return Ok(None);
        }
        let mut backward = self.backward()?;
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
                Trail::with_nodes(),
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
            backward.pass((&again, &trail), &seen)?;
        }
        Ok(Some((sum, backward)))
    }

    #[cfg(feature = "sparse")]
    fn backward(&self) -> Result<Backward<'_, M>, RunErrorKind> {
        Backward::new(&*self.model, self.chosen_element(), self.control)
    }

    #[cfg(feature = "sparse")]
    fn gathered(
        &self,
        motion: Motion<0, RunTimeLength>,
        backward: &Backward<'_, M>,
    ) -> Result<LossGradient<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let names = 0..self.model.parameters();
        let names = names.map(|at| self.model.parameter_name(at).to_string());
        let (by_parameters, by_start) = (backward.by_parameters(), backward.by_start());
        LossGradient::new(motion, names.collect(), by_parameters, by_start)
    }
}
