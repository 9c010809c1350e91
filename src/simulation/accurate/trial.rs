//! The runs of a model of either kind of length that are compared with each other, and the motion that they leave.

use super::super::events::Severed;
use super::super::follow::Follow;
use super::super::kind::{Chosen, Simulated};
use super::super::mesh::{Mesh, Ordered};
use super::super::setup::Simulation;
use super::super::times::Times;
use super::repeatable::{Arrived, At, Given, Passing, Repeatable, Stepping, trusting};
use crate::accuracy::Estimated;
use crate::error::{RunError, RunErrorKind};
use crate::length::Length;
use crate::motion::{Motion, Warning};
use std::cell::RefCell;
use std::ops::{ControlFlow, Range};
use tfe_runtime::constrained::Trail;
use tfe_runtime::step::Control;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{CoordinateName, Element, Share, Statistics, StepError};

impl<M, const N: usize, L> Simulation<'_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// See [`Given::has_events`].
    pub(super) fn has_events(&self) -> bool {
        !self.events.is_empty()
    }
}

/// A run that can be made with other elements and steps, with the motion that it keeps.
pub(super) struct Trial<'r, 'm, M: 'm, const N: usize, L: Length<N>> {
    run: &'r Simulation<'m, M, N, L>,
    start: (f64, &'r L::State),
    given: Given<'r>,
    /// The impulses that act inside elements.
    impulses: Ordered<N>,
    /// The last motion that was recorded to its end; before there is one, the first that failed.
    kept: RefCell<Option<Motion<N, L>>>,
}

impl<'r, 'm, M, const N: usize, L> Trial<'r, 'm, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    pub(super) fn new(
        run: &'r Simulation<'m, M, N, L>,
        (t, start): (f64, &'r L::State),
        span: &Range<f64>,
    ) -> Self {
        Self {
            given: Given {
                element: run.chosen_element(),
                control: run.control,
                progress: run.progress,
                coordinates: run.model.coordinates(),
                outputs: shown(&run.model.output_names()),
                start: (t, L::numbers(start)),
                breaks: &run.breaks,
                nodes: run.nodes.as_deref(),
                is_constrained: M::IS_CONSTRAINED,
                has_events: run.has_events(),
                crosses_kinks: run.crosses_kinks(),
            },
            run,
            start: (t, start),
            impulses: Ordered::of(M::inner(&run.impulses), span),
            kept: RefCell::new(None),
        }
    }

    /// The motion that was kept with what was found, or with why nothing was; `farthest` is the time and the state that
    /// runs without a motion have reached.
    pub(super) fn told(
        &self,
        found: Result<Estimated<()>, RunErrorKind>,
        farthest: Option<(f64, Vec<f64>)>,
    ) -> Result<Estimated<Motion<N, L>>, RunError<N, L>> {
        let motion = match self.kept.take() {
            Some(motion) => motion,
            None => self.part(farthest),
        };
        match found {
            Ok(found) => Ok(found.of(motion)),
            Err(kind) => Err(RunError::new(kind, motion)),
        }
    }

    /// A motion of only the start and the state that was reached, for a run that failed.
    fn part(&self, farthest: Option<(f64, Vec<f64>)>) -> Motion<N, L> {
        let Self { run, start, .. } = *self;
        let part = run.model.guarded(|| {
            let Ok(mut stepper) = M::stepper(run.model.clone(), run.chosen()) else {
                return run.model.first_node(start, None);
            };
            let mut motion = run.model.first_node(start, Some(&mut stepper));
            if let Some((t, state)) = &farthest
                && *t != start.0
            {
                let state = L::state_of(start.1, state);
                M::record(&mut motion, &mut stepper, &run.model, (*t, &state));
            }
            motion
        });
        part.unwrap_or_else(|| Motion::unknown(&*run.model, start.0, start.1))
    }

    /// Runs over a mesh; returns the motion, and why it ends before the mesh.
    fn record(
        &self,
        stepper: &mut L::Stepper<'m, M>,
        mesh: &Times,
        passed: &mut Passing<'_>,
    ) -> (Motion<N, L>, Option<RunErrorKind>) {
        let Self { run, start, .. } = *self;
        let mut compared = Compared {
            passed,
            model: run.model.clone(),
            acts: 0,
            last: start.0,
            goes_on: ControlFlow::Continue(()),
        };
        let whole = Mesh::of(mesh, &self.impulses);
        let mut motion = match run.drive_over(start, &whole, stepper, Some(&mut compared)) {
            Ok(motion) => motion,
            Err(error) => {
                let kind = error.kind().clone();
                return (error.into_partial(), Some(kind));
            }
        };
        if self.given.crosses_kinks {
            motion.add_warning(Warning::KinksCrossed);
        }
        // After an event has stopped the run, its state and parameters are kept to the end of the span.
        let ahead = match compared.goes_on {
            ControlFlow::Continue(()) => mesh.ends_behind(compared.last, start.0),
            ControlFlow::Break(()) => Vec::new(),
        };
        if ahead.is_empty() {
            return (motion, None);
        }
        let Compared { model, acts, .. } = compared;
        let is_changed = !motion.settings().is_empty();
        if is_changed && let Err(kind) = M::exchange(stepper, model.clone()) {
            return (motion, Some(kind));
        }
        let state = motion.last().state();
        for t in ahead {
            let mut arrived = Place::<M, N, L> {
                stepper: &mut *stepper,
                model: &*model,
                t,
                state: &state,
            };
            let _ = passed(&mut At {
                t,
                acts,
                arrived: &mut arrived,
            });
        }
        let restored = match is_changed {
            true => M::exchange(stepper, run.model.clone()),
            false => Ok(()),
        };
        (motion, restored.err())
    }

    fn keep(&self, motion: Motion<N, L>, is_whole: bool) {
        let mut kept = self.kept.borrow_mut();
        if is_whole || kept.is_none() {
            *kept = Some(motion);
        }
    }
}

impl<M, const N: usize, L> Repeatable for Trial<'_, '_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn given(&self) -> &Given<'_> {
        &self.given
    }

    fn stepper(
        &self,
        element: Element,
        control: Control,
        is_recorded: bool,
    ) -> Result<Box<dyn Stepping + '_>, RunErrorKind> {
        let Self { run, start, .. } = *self;
        let chosen = Chosen {
            element,
            control: trusting(control),
            ..run.chosen()
        };
        let stepper = M::stepper(run.model.clone(), chosen)?;
        let looks_inside = self.given.has_events || (is_recorded && run.record_every == 1);
        let stepper = match looks_inside {
            true => stepper,
            false => M::ends_only(stepper),
        };
        Ok(Box::new(Placed {
            trial: self,
            stepper,
            t: start.0,
            state: start.1.clone(),
        }))
    }

    fn failed(&self, element: usize, at: (f64, f64), source: StepError) -> RunErrorKind {
        let why = (self.run.chosen().at_kinks, source);
        self.run.model.failed(element, at, why)
    }
}

/// A stepper of a trial in a state of its own.
struct Placed<'s, 'r, 'm, M: 'm, const N: usize, L: Length<N>> {
    trial: &'s Trial<'r, 'm, M, N, L>,
    stepper: L::Stepper<'m, M>,
    t: f64,
    state: L::State,
}

impl<'m, M, const N: usize, L> Placed<'_, '_, 'm, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn here(&mut self) -> Place<'_, 'm, M, N, L> {
        Place {
            stepper: &mut self.stepper,
            model: &*self.trial.run.model,
            t: self.t,
            state: &self.state,
        }
    }
}

impl<M, const N: usize, L> Arrived for Placed<'_, '_, '_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn row(&mut self, row: &mut [f64]) {
        self.here().row(row);
    }

    fn leave(&self, trail: &mut Trail) {
        M::leave(&self.stepper, trail);
    }

    fn foresee(&mut self, trail: &Trail, step: (f64, f64)) {
        M::foresee(&mut self.stepper, trail, step);
    }
}

impl<M, const N: usize, L> Stepping for Placed<'_, '_, '_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn place(&mut self, t: f64, state: &[f64]) {
        (self.t, self.state) = (t, L::state_of(&self.state, state));
    }

    fn state(&self) -> Vec<f64> {
        L::numbers(&self.state)
    }

    fn advance(&mut self, mesh: &Times, (t, next, h): (f64, f64, f64)) -> Result<(), StepError> {
        let Trial { run, impulses, .. } = self.trial;
        let (stepper, state) = (&mut self.stepper, &mut self.state);
        run.model.kick(&run.impulses, (t, h), state);
        let impulses = impulses.within(t, next, mesh.end() == Some(next));
        let element = (mesh.begin(t, h), h);
        // A panic is reported by the recorded run, which meets it first.
        let advanced = (run.model).guarded(|| M::advance(stepper, element, state, impulses));
        let advanced = advanced.unwrap_or(Err(StepError::NonFinite));
        if advanced.is_ok() {
            self.t = next;
        }
        advanced
    }

    fn record(
        &mut self,
        mesh: &Times,
        may_be_kept: bool,
        passed: &mut Passing<'_>,
    ) -> Result<(), RunErrorKind> {
        let (motion, failure) = self.trial.record(&mut self.stepper, mesh, passed);
        if may_be_kept {
            self.trial.keep(motion, failure.is_none());
        }
        match failure {
            Some(kind) => Err(kind),
            None => Ok(()),
        }
    }

    fn set_tolerance(&mut self, tolerance: f64) {
        M::set_tolerance(&mut self.stepper, tolerance);
    }

    fn statistics(&self) -> Statistics {
        *M::statistics(&self.stepper)
    }

    fn take_statistics(&mut self) -> Statistics {
        M::take_statistics(&mut self.stepper)
    }
}

/// A stepper at a place that a run has reached, with the model as it is there.
struct Place<'a, 'm, M: 'm, const N: usize, L: Length<N>> {
    stepper: &'a mut L::Stepper<'m, M>,
    model: &'a M,
    t: f64,
    state: &'a L::State,
}

impl<M, const N: usize, L> Arrived for Place<'_, '_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn row(&mut self, row: &mut [f64]) {
        let Self {
            model, t, state, ..
        } = *self;
        let (q, p) = L::parts(state);
        let outputs = write_state(row, q.as_ref(), p.as_ref());
        if outputs.is_empty() {
            return;
        }
        let still = L::zero(q);
        let velocity = match const { M::NEEDS_VELOCITY } {
            true => M::node(self.stepper, model, (t, state), &still).v,
            false => still,
        };
        model.outputs(t, (q, p), &velocity, outputs);
    }

    fn leave(&self, trail: &mut Trail) {
        M::leave(self.stepper, trail);
    }

    fn foresee(&mut self, trail: &Trail, step: (f64, f64)) {
        M::foresee(self.stepper, trail, step);
    }
}

/// Writes a state into a row; returns the rest of the row, that of the outputs.
fn write_state<'r>(row: &'r mut [f64], q: &[f64], p: &[f64]) -> &'r mut [f64] {
    let (of_q, rest) = row.split_at_mut(q.len());
    let (of_p, outputs) = rest.split_at_mut(p.len());
    of_q.copy_from_slice(q);
    of_p.copy_from_slice(p);
    outputs
}

/// Names as they are shown.
pub(super) fn shown(names: &[CoordinateName]) -> Vec<String> {
    names.iter().map(ToString::to_string).collect()
}

/// The follower that reports the end of each element to a comparison of runs.
struct Compared<'a, 'p, 'm, M> {
    passed: &'a mut Passing<'p>,
    /// The model with the parameters set by events so far.
    model: Share<'m, M>,
    /// The number of events that have cut an element so far.
    acts: usize,
    last: f64,
    goes_on: ControlFlow<()>,
}

impl<'m, M, const N: usize, L> Follow<'m, M, N, L> for Compared<'_, '_, 'm, M>
where
    M: Simulated<N, L> + 'm,
    L: Length<N>,
{
    fn cut(&mut self, _: &Severed<'_, 'm, N, L>) -> Result<(), TransitionError> {
        self.acts += 1;
        Ok(())
    }

    fn set(&mut self, model: &Share<'m, M>) -> Result<(), RunErrorKind> {
        self.model = model.clone();
        Ok(())
    }

    fn reached(
        &mut self,
        stepper: &mut L::Stepper<'m, M>,
        t: f64,
        state: &L::State,
    ) -> ControlFlow<()> {
        self.last = t;
        let mut arrived = Place::<M, N, L> {
            stepper,
            model: &*self.model,
            t,
            state,
        };
        self.goes_on = (self.passed)(&mut At {
            t,
            acts: self.acts,
            arrived: &mut arrived,
        });
        self.goes_on
    }
}
