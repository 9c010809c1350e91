//! Runs over a span, and endless runs.

use super::checks::{check_breaks, check_tolerance};
use super::events::Events;
use super::follow::Follower;
use super::kind::{Chosen, Simulated};
use super::mesh::Mesh;
use super::pieces::{Broken, Left, Pieces, Planned, Solver, planned};
use super::progress;
use super::recorder::Recorder;
use super::setup::Simulation;
use super::steps::{Beginning, Steps};
use super::times::{AtEnds, Endless};
use crate::error::{RunError, RunErrorKind};
use crate::length::Length;
use crate::motion::{Motion, Reached, Seen};
use std::mem;
use std::ops::Range;

impl<'m, M, const N: usize, L> Simulation<'m, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// Integrates the model from `start` over the span; backwards in time if the span ends before it starts. The last
    /// node is exactly at the end of the span.
    ///
    /// Look at [`Motion::warnings`] after the run: it lists signs that the result may be wrong although no step
    /// failed.
    ///
    /// # Errors
    /// [`RunError`] says where and why the run stopped, and holds the motion up to there. Its [kinds](RunErrorKind) are
    ///
    /// - before the first element: [`Element`](RunErrorKind::Element), [`Family`](RunErrorKind::Family) for an element or a
    ///   model that is invalid or not supported; [`Span`](RunErrorKind::Span), [`Step`](RunErrorKind::Step),
    ///   [`TooManySteps`](RunErrorKind::TooManySteps), [`StepUnresolved`](RunErrorKind::StepUnresolved),
    ///   [`NodeOrder`](RunErrorKind::NodeOrder), [`NodeEnds`](RunErrorKind::NodeEnds) for the mesh;
    ///   [`Start`](RunErrorKind::Start), [`Inconsistent`](RunErrorKind::Inconsistent) for the start;
    ///   [`Tolerance`](RunErrorKind::Tolerance), [`Break`](RunErrorKind::Break), [`Impulse`](RunErrorKind::Impulse),
    ///   [`NoEvent`](RunErrorKind::NoEvent), [`Input`](RunErrorKind::Input) for what else was set;
    /// - later: [`Solve`](RunErrorKind::Solve) for an element that cannot be solved, [`Input`](RunErrorKind::Input) for a
    ///   function of an input that fails in one; at events [`EventsWithoutEnd`](RunErrorKind::EventsWithoutEnd),
    ///   [`NoParameter`](RunErrorKind::NoParameter), [`Parameter`](RunErrorKind::Parameter),
    ///   [`ParametersFixed`](RunErrorKind::ParametersFixed), and [`Start`](RunErrorKind::Start),
    ///   [`Inconsistent`](RunErrorKind::Inconsistent) for the state from which the run was to continue.
    ///
    /// # Example
    /// ```
    /// # use tfe::prelude::*;
    /// # #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
    /// # struct Oscillator { m: f64, k: f64 }
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let oscillator = Oscillator { m: 1.0, k: 1.0 };
    /// // The amplitude grows between √10 and √12, where the oscillator's own does not.
    /// let simulation = Simulation::new(&oscillator).element(Primal::<3>).step(3.3);
    /// let motion = simulation.run(oscillator.state([1.0], [0.0]), 0.0..330.0)?;
    /// for warning in motion.warnings() {
    ///     println!("{warning}");
    /// }
    /// assert_eq!(motion.warnings().len(), 1);
    /// # Ok(())
    /// # }
    /// ```
    pub fn run(&self, start: L::State, span: Range<f64>) -> Result<Motion<N, L>, RunError<N, L>> {
        // For nonlinear models, polynomials inside elements are only computed where there may be an event.
        let looks_now_and_then = self.events.is_empty() || M::MAY_ITERATE;
        let ends_only = self.record_every != 1 && looks_now_and_then;
        let ready = |stepper| match ends_only {
            true => M::ends_only(stepper),
            false => stepper,
        };
        self.drive(start, &span, ready, None)
    }

    /// Runs over the span and calls `follower`.
    pub(super) fn drive(
        &self,
        start: L::State,
        span: &Range<f64>,
        ready: impl FnOnce(L::Stepper<'m, M>) -> L::Stepper<'m, M>,
        follower: Follower<'_, 'm, M, N, L>,
    ) -> Result<Motion<N, L>, RunError<N, L>> {
        let prepared = self.model.guarded(|| {
            let mut prepared = self.prepare(&start, span);
            let stepper = match &mut prepared {
                Ok((_, stepper)) => Some(stepper),
                Err(_) => None,
            };
            let motion = self.model.first_node((span.start, &start), stepper);
            (prepared, motion)
        });
        let Some((prepared, motion)) = prepared else {
            let motion = Motion::unknown(&*self.model, span.start, &start);
            return Err(RunError::new(RunErrorKind::panicked(span.start), motion));
        };
        let (mesh, stepper) = match prepared {
            Ok(prepared) => prepared,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let place = (&mesh, 0, span.start, None);
        self.drive_on(motion, &start, place, ready(stepper), follower)
    }

    /// Continues from the only node of `motion` over a mesh of which `done` elements are done, and leaves a checkpoint.
    pub(super) fn drive_on(
        &self,
        motion: Motion<N, L>,
        start: &L::State,
        (mesh, done, origin, before): (&Mesh<N>, usize, f64, Option<(&Reached, Seen)>),
        mut stepper: L::Stepper<'m, M>,
        follower: Follower<'_, 'm, M, N, L>,
    ) -> Result<Motion<N, L>, RunError<N, L>> {
        let (before, seen) = before.unzip();
        let mut seen = seen.unwrap_or_default();
        let place = (mesh, done, &mut seen);
        let mut motion = self.drive_from(motion, start, place, &mut stepper, follower)?;
        if goes_on(&mut motion, &seen) {
            let time = motion.last().t;
            let reached = Reached::after(before, (mesh, done, origin), self.step, time);
            motion.leave_checkpoint(reached, M::suspended(stepper), seen);
        }
        Ok(motion)
    }

    /// Runs over a mesh with a new stepper.
    pub(super) fn drive_over(
        &self,
        (t0, start): (f64, &L::State),
        mesh: &Mesh<N>,
        stepper: &mut L::Stepper<'m, M>,
        follower: Follower<'_, 'm, M, N, L>,
    ) -> Result<Motion<N, L>, RunError<N, L>> {
        let motion = self.model.first_node((t0, start), Some(stepper));
        let place = (mesh, 0, &mut Seen::default());
        self.drive_from(motion, start, place, stepper, follower)
    }

    /// The same from the only node of `motion`, after the elements that are done. `seen` is the record of events at the
    /// start; it becomes that at the end.
    fn drive_from(
        &self,
        motion: Motion<N, L>,
        start: &L::State,
        (mesh, done, seen): (&Mesh<N>, usize, &mut Seen),
        stepper: &mut L::Stepper<'m, M>,
        follower: Follower<'_, 'm, M, N, L>,
    ) -> Result<Motion<N, L>, RunError<N, L>> {
        let mut pieces = match self.pieces(stepper) {
            Ok(pieces) => pieces,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        pieces.events.seen.go_on(seen);
        let mut recorder = Recorder::new(self, motion, follower);
        let mut state = start.clone();
        let mut bar = progress::Bar::new(self.progress, mesh.steps() - done);
        let mut failure = None;
        for element in planned(mesh, done) {
            let Planned { number, t, h, .. } = element;
            let is_last = number + 1 == mesh.steps();
            let is_kicked = pieces.model().kick(&self.impulses, (t, h), &mut state);
            let has_impulses = is_kicked || !element.impulses.is_empty();
            recorder.begin(pieces.model(), number, (t, h), &state, has_impulses);
            let passed = self.model.guarded(|| {
                let left = pieces.pass(stepper, element, &mut state, &mut recorder)?;
                if left == Left::Done {
                    let model = pieces.model();
                    recorder.end(stepper, model, (number, is_last), (element.next, &state));
                }
                Ok(left)
            });
            match Broken::<N, L>::unless_panicked(passed, t) {
                Ok(Left::Done) => {}
                Ok(Left::Stopped) => {
                    pieces.events.seen.has_stopped = true;
                    break;
                }
                Err(broken) => {
                    recorder.fail(stepper, pieces.model(), number, &broken);
                    failure = Some(broken.kind);
                    break;
                }
            }
            bar.advance();
        }
        let mut motion = recorder.into_motion(stepper, &state, pieces.events.warnings());
        if let Err(kind) = pieces.restore(stepper, &self.model) {
            failure.get_or_insert(kind);
        }
        *seen = mem::take(&mut pieces.events.seen);
        motion.set_events(mem::take(&mut pieces.events.met));
        RunError::unless_whole(motion, failure)
    }

    /// The part that solves elements and looks for events.
    pub(super) fn pieces(
        &self,
        stepper: &L::Stepper<'m, M>,
    ) -> Result<Pieces<'m, M, N, L>, RunErrorKind> {
        let (element, control) = M::chosen(stepper);
        let chosen = Chosen {
            element,
            control,
            ..self.chosen()
        };
        let events = Events::new(&*self.model, &self.events)?;
        let solver = Solver::new(self.model.clone(), self.events.remodel(), chosen);
        Ok(Pieces::new(solver, events, self.events.search()))
    }

    /// Checks whether the run can begin at `start`.
    pub(super) fn check_start(&self, start: &L::State) -> Result<(), RunErrorKind> {
        if let Some(refusal) = &self.refusal {
            return Err(refusal.clone());
        }
        check_tolerance(self.control.tolerance)?;
        check_breaks(&self.breaks)?;
        self.model.check_start(start, &self.impulses)
    }

    /// Checks the arguments; returns the mesh and the stepper of a run.
    pub(super) fn prepare(
        &self,
        start: &L::State,
        span: &Range<f64>,
    ) -> Result<(Mesh<N>, L::Stepper<'m, M>), RunErrorKind> {
        self.check_start(start)?;
        let mesh = self.mesh(span)?;
        if let Some(h) = mesh.first_step() {
            self.model.check_first((span.start, h), start)?;
        }
        let mut stepper = M::stepper(self.model.clone(), self.chosen())?;
        M::check_velocity(&mut stepper, (span.start, start))?;
        Ok((mesh, stepper))
    }

    pub(super) fn mesh(&self, span: &Range<f64>) -> Result<Mesh<N>, RunErrorKind> {
        Ok(M::mesh(span, &self.grid())?.with(self.at_ends()))
    }

    /// See [`AtEnds`].
    pub(super) fn at_ends(&self) -> AtEnds {
        AtEnds::of(self.chosen_element(), M::IS_CONSTRAINED)
    }

    /// An iterator over the nodes that follow `start`, one for each [step](Self::step), without end and in constant
    /// memory. A step size must be set; elements also end at [breaks](Self::break_at), as in [`run`](Self::run).
    ///
    /// The errors are those of [`run`](Self::run), as [`RunErrorKind`]; after one the iterator ends.
    /// [`Steps::warnings`] lists signs that the steps so far may be wrong.
    ///
    /// A step in which an [event](Self::on) changes the state or a parameter has two more nodes, with the states
    /// before and after the event; after the node at which an event stops the run the iterator ends. [`Steps::events`]
    /// lists the events of the last step.
    ///
    /// ```
    /// # use tfe::prelude::*;
    /// # #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
    /// # struct Oscillator { m: f64, k: f64 }
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let oscillator = Oscillator { m: 1.0, k: 1.0 };
    /// let simulation = Simulation::new(&oscillator).step(0.1);
    /// for node in simulation.steps(oscillator.state([1.0], [0.0]), 0.0) {
    ///     let node = node?;
    ///     if node.q[0] < 0.0 {
    ///         println!("passed zero before t = {}", node.t);
    ///         // At π/2, between two steps.
    ///         assert!((node.t - 1.6).abs() < 1e-12);
    ///         break;
    ///     }
    /// }
    /// # Ok(())
    /// # }
    /// ```
    pub fn steps(&self, start: L::State, t0: f64) -> Steps<'m, M, N, L> {
        let new = |beginning| {
            let (model, impulses) = (self.model.clone(), self.impulses.clone());
            let begin = (t0, start.clone());
            Steps::new(model, beginning, begin, impulses, self.again())
        };
        let begun = self.model.guarded(|| new(self.endless(&start, t0)));
        begun.unwrap_or_else(|| new(Err(RunErrorKind::panicked(t0))))
    }

    /// Prepares a run without an end.
    pub(super) fn endless(&self, start: &L::State, t0: f64) -> Beginning<'m, M, N, L> {
        let step = self.step.unwrap_or(f64::NAN);
        self.check_start(start)?;
        self.model.check_first((t0, step), start)?;
        if !t0.is_finite() {
            return Err(RunErrorKind::Span {
                start: t0,
                end: f64::INFINITY,
            });
        }
        let elements = Endless::new(t0, step, &self.breaks)?.with(self.at_ends());
        let mut stepper = M::stepper(self.model.clone(), self.chosen())?;
        M::check_velocity(&mut stepper, (t0, start))?;
        if self.events.is_empty() {
            return Ok((M::ends_only(stepper), elements, None));
        }
        let pieces = self.pieces(&stepper)?;
        Ok((stepper, elements, Some(pieces)))
    }
}

/// Whether a run can be continued from its end. One that an event has stopped has no grid to continue on; one whose
/// parameters were set would need another model.
fn goes_on<const N: usize, L: Length<N>>(motion: &mut Motion<N, L>, seen: &Seen) -> bool {
    if seen.has_stopped {
        motion.set_stopped();
    }
    !motion.is_stopped() && motion.settings().is_empty()
}
