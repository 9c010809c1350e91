//! Runs: a model, an element, a step, a span.

mod accurate;
mod checkpoint;
mod course;
mod events;
pub(crate) mod family;
mod follow;
mod gradient;
mod held;
mod inputs;
mod linearise;
pub(crate) mod mesh;
mod pieces;
mod progress;
mod recorder;
mod section;
mod sensitive;
mod steps;
mod watch;

use crate::error::{RunError, RunErrorKind};
use crate::motion::Motion;
use events::{Events, On, Remodel};
use family::Runs;
use follow::{Follow, Nobody};
use mesh::{Endless, Mesh};
use pieces::{Broken, Left, Pieces, Planned};
use recorder::Recorder;
use std::ops::Range;
use steps::Beginning;
use tfe_runtime::constrained::{self, Residual};
use tfe_runtime::length::Declared;
use tfe_runtime::step::{Control, Impulse, Stepper};

use tfe_runtime::{Element, Mixed, Model, Share, Solve, State};

use watch::resolution::Again;

pub(crate) use crate::motion::Reached;
pub use crate::motion::Warning;
pub use crate::motion::{Checkpoint, FamilyCheckpoint};
pub use accurate::Accurate;
pub(crate) use events::Watching;
pub use events::{Act, Crossing, Event, Occurrence, Settings};
pub use held::{Held, HeldNode};
pub use section::{Section, SectionPoint};
pub use steps::Steps;
pub(crate) use watch::is_jump;

/// A run to be: which model, with which element and step.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
/// struct Oscillator { m: f64, k: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let oscillator = Oscillator { m: 1.0, k: 1.0 };
/// let motion = Simulation::new(&oscillator)
///     .element(Mixed::<4>)
///     .step(0.1)
///     .run(oscillator.state([1.0], [0.0]), 0.0..10.0)?;
/// assert!((motion.last().q[0] - 10.0_f64.cos()).abs() < 1e-8);
/// # Ok(())
/// # }
/// ```
///
/// Defaults: `Mixed::<4>` (order 6), a thousandth of the span as step, every node recorded, iteration to round-off.
#[derive(Debug)]
pub struct Simulation<'m, M, const N: usize> {
    model: Share<'m, M>,
    /// The default where it is not chosen.
    element: Option<Element>,
    step: Option<f64>,
    nodes: Option<Vec<f64>>,
    control: Control,
    record_every: usize,
    impulses: Vec<Impulse<N>>,
    breaks: Vec<f64>,
    events: Vec<On<'m, N>>,
    /// Makes models with other parameters, where events may ask for them.
    remodel: Option<Remodel<'m, M>>,
    /// What was asked for.
    at_kinks: Option<bool>,
    progress: bool,
    /// What was asked for and cannot be done.
    refusal: Option<RunErrorKind>,
}

impl<M, const N: usize> Clone for Simulation<'_, M, N> {
    fn clone(&self) -> Self {
        Self {
            model: self.model.clone(),
            nodes: self.nodes.clone(),
            impulses: self.impulses.clone(),
            breaks: self.breaks.clone(),
            events: self.events.clone(),
            refusal: self.refusal.clone(),
            ..*self
        }
    }
}

impl<'m, M, const N: usize> Simulation<'m, M, N> {
    /// A run of `model` with the defaults: this type for a model of fixed size, [`FamilySimulation`](crate::family::FamilySimulation) for one of
    /// run-time length, which has methods of the same names.
    #[allow(
        clippy::new_ret_no_self,
        reason = "one name for models of both kinds of length"
    )]
    pub fn new(model: &'m M) -> <M::Length as Runs<M, N>>::Simulation<'m>
    where
        M: Declared<N, Length: Runs<M, N>>,
    {
        M::Length::with_defaults(model)
    }
}

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    pub(crate) fn with_defaults(model: &'m M) -> Self {
        Self {
            model: Share::Borrowed(model),
            element: None,
            step: None,
            nodes: None,
            control: Control::default(),
            record_every: 1,
            impulses: Vec::new(),
            breaks: Vec::new(),
            events: Vec::new(),
            remodel: None,
            at_kinks: None,
            progress: false,
            refusal: None,
        }
    }

    /// The element: `Mixed::<4>`, `Primal::<3>.reduced()`, `Element::mixed(n)`, …
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = Some(element.into());
        self
    }

    /// The step h, in the units of time. Where the span is no whole number of steps the last one is shorter.
    #[must_use]
    pub fn step(mut self, step: f64) -> Self {
        self.step = Some(step);
        self
    }

    /// The nodes: every element goes from one of these times to the next, and ends at every [break](Self::break_at) besides. They begin and end with the span of the run;
    /// instead of a [step](Self::step). [`steps`](Self::steps), which has no end, does not use them.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 + 1/x)]
    /// struct Fall;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // From rest at a distance of one, x = cos² u at t = (u + sin u cos u)/√2: shorter steps towards the centre.
    /// let time = |u: f64| (u + u.sin() * u.cos()) / 2.0_f64.sqrt();
    /// let nodes: Vec<f64> = (0..=30).map(|k| time(0.05 * f64::from(k))).collect();
    /// let simulation = Simulation::new(&Fall).element(Mixed::<8>).nodes(nodes.iter().copied());
    /// let motion = simulation.run(Fall.state([1.0], [0.0]), 0.0..time(1.5))?;
    /// assert_eq!(motion.states().len(), 31);
    /// assert!((motion.last().q[0] - 1.5_f64.cos().powi(2)).abs() < 1e-8);
    /// assert!(simulation.run(Fall.state([1.0], [0.0]), 0.0..1.0).is_err()); // the nodes end elsewhere
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn nodes(mut self, times: impl IntoIterator<Item = f64>) -> Self {
        self.nodes = Some(times.into_iter().collect());
        self
    }

    /// What the iteration inside an element may leave, relative to the state. It is judged by the rest of the geometric series of its increments, a fixed point by a 64th of that. Elements of a
    /// run leave errors of the same sign, so that they add up; below some 1e-15 all values do the same, since roundings end the iteration. The default iterates to round-off; above 1e-14
    /// the sums of a step are no longer carried with what rounding takes from them (`docs/theory.md` §10.4). Models with constraints take 1e-9 for anything larger.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// The most iterations an element may take before the run stops with an error.
    #[must_use]
    pub fn max_iterations(mut self, iterations: u32) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// How the element's equations are solved; `Solve::Auto` by default, which cuts steps whose solution is not proven to continue the motion ([`Solve::Trusting`] does
    /// not; `docs/theory.md` §10.6).
    #[must_use]
    pub fn solver(mut self, solve: Solve) -> Self {
        self.control.solve = solve;
        self
    }

    /// Records every `k`-th node (and always the first and the last). With `k` > 1 the elements' polynomials are not kept, so a long run takes
    /// little memory but [`Motion::at`] knows the recorded nodes only. 0 counts as 1.
    #[must_use]
    pub fn record_every(mut self, k: usize) -> Self {
        self.record_every = k.max(1);
        self
    }

    /// Adds an impulse: a generalized force of the given time integral that acts at one instant. Inside an element it is weighted by the test
    /// functions, at a node it changes the momentum there (`docs/theory.md`, impulses). The node at that instant shows the momentum before it.
    #[must_use]
    pub fn impulse(mut self, time: f64, impulse: [f64; N]) -> Self {
        self.impulses.push(Impulse {
            time,
            value: impulse,
        });
        self
    }

    /// Makes an element end at `time`: where a force jumps, an element across the jump would lose its order.
    #[must_use]
    pub fn break_at(mut self, time: f64) -> Self {
        self.breaks.push(time);
        self
    }

    /// Whether steps are cut where a force has a kink or a jump: where the argument of an `abs` or `sign`, the condition of a `select`, or the difference of the arguments
    /// of a `min` or `max` changes its sign, in the state or in time (`docs/theory.md` §10.7). Elements keep their order then, and the run stays on the grid asked for;
    /// [`Statistics::kinks`](crate::Statistics::kinks) counts the crossings. A motion that would slide along a jump is an error, [`StepError::Slides`](crate::runtime::StepError::Slides).
    ///
    /// [`run`](Self::run), [`steps`](Self::steps) and [`run_estimated`](Self::run_estimated) do so only if asked, runs with an [`accuracy`](Self::accuracy) unless forbidden;
    /// [`run_linearised`](Self::run_linearised) refuses to, as [`RunErrorKind::KinksUnsupported`].
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A mass that falls onto a spring.
    /// #[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - g*y - k/2*min(y, 0)^2)]
    /// struct Landing { g: f64, k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let landing = Landing { g: 10.0, k: 1e4 };
    /// let simulation = Simulation::new(&landing).element(Mixed::<6>).step(0.02).at_kinks(true);
    /// let motion = simulation.run(landing.state([0.05], [0.0]), 0.0..1.0)?;
    /// assert!(motion.statistics().kinks > 5);
    /// let energies = motion.energies();
    /// assert!(energies.iter().all(|energy| (energy - 0.5).abs() < 1e-12));
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn at_kinks(mut self, are_cut: bool) -> Self {
        self.at_kinks = Some(are_cut);
        self
    }

    /// Shows the progress of long runs on standard error, once a second.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.progress = true;
        self
    }

    /// Runs over the span, backwards where it ends before it starts. The last node is exactly at the end of the span.
    ///
    /// What is doubtful about the result without being an error is in [`Motion::warnings`].
    ///
    /// # Errors
    /// [`RunError`] says where and why the run stopped and holds the motion so far.
    ///
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
    pub fn run(&self, start: State<N>, span: Range<f64>) -> Result<Motion<N>, RunError<N>> {
        let ends_only = self.record_every != 1 && self.events.is_empty();
        let ready = |stepper: Stepper<'m, M, N>| {
            let stepper = self.cutting(stepper);
            if ends_only {
                stepper.ends_only()
            } else {
                stepper
            }
        };
        self.drive(start, &span, ready, Nobody)
    }

    /// A stepper that cuts steps at kinks, if that was asked for.
    fn cutting(&self, stepper: Stepper<'m, M, N>) -> Stepper<'m, M, N> {
        if self.at_kinks == Some(true) {
            stepper.at_kinks()
        } else {
            stepper
        }
    }

    /// Runs over the span, followed by `follower`.
    fn drive(
        &self,
        start: State<N>,
        span: &Range<f64>,
        ready: impl FnOnce(Stepper<'m, M, N>) -> Stepper<'m, M, N>,
        follower: impl Follow<'m, M, N>,
    ) -> Result<Motion<N>, RunError<N>> {
        let prepared = self.model.guarded(|| {
            let motion = Motion::from_start(&*self.model, span.start, &start);
            (self.prepare(&start, span), motion)
        });
        let Ok((prepared, motion)) = prepared else {
            let motion = Motion::unknown(&*self.model, span.start, &start);
            return Err(RunError::new(RunErrorKind::panicked(span.start), motion));
        };
        let (mesh, stepper) = match prepared {
            Ok(prepared) => prepared,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let place = (&mesh, 0, span.start);
        self.drive_on(motion, &start, place, ready(stepper), follower)
    }

    /// Goes on from the only node of `motion` over a mesh of which some elements are done, and leaves a checkpoint.
    fn drive_on(
        &self,
        motion: Motion<N>,
        start: &State<N>,
        (mesh, done, origin): (&Mesh<N>, usize, f64),
        mut stepper: Stepper<'m, M, N>,
        follower: impl Follow<'m, M, N>,
    ) -> Result<Motion<N>, RunError<N>> {
        let mut motion = self.drive_from(motion, start, (mesh, done), &mut stepper, follower)?;
        let last = *motion.last();
        // A run that was stopped has no grid to go on with, and one whose parameters were set no model.
        if mesh.end().is_some_and(|end| end != last.t) || !motion.settings().is_empty() {
            return Ok(motion);
        }
        motion.set_checkpoint(Checkpoint {
            reached: Reached::new(origin, self.step, mesh, last.t),
            state: last.state(),
            velocity: motion.velocities().last().copied().unwrap_or([0.0; N]),
            stepper: stepper.suspend(),
        });
        Ok(motion)
    }

    /// Runs over a mesh with a stepper at rest.
    fn drive_over(
        &self,
        start: State<N>,
        t0: f64,
        mesh: &Mesh<N>,
        stepper: &mut Stepper<'m, M, N>,
        follower: impl Follow<'m, M, N>,
    ) -> Result<Motion<N>, RunError<N>> {
        let motion = Motion::from_start(&*self.model, t0, &start);
        self.drive_from(motion, &start, (mesh, 0), stepper, follower)
    }

    /// The same from the only node of `motion`, after the elements that are done.
    fn drive_from(
        &self,
        motion: Motion<N>,
        start: &State<N>,
        (mesh, done): (&Mesh<N>, usize),
        stepper: &mut Stepper<'m, M, N>,
        follower: impl Follow<'m, M, N>,
    ) -> Result<Motion<N>, RunError<N>> {
        let mut pieces = match self.pieces(stepper) {
            Ok(pieces) => pieces,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let mut recorder = Recorder::new(self, motion, start, follower);
        let mut state = *start;
        let mut bar = progress::Bar::new(self.progress, mesh.steps() - done);
        let mut failure = None;
        for (number, (t, next, h)) in mesh.elements().enumerate().skip(done) {
            let is_last = number + 1 == mesh.steps();
            let planned = Planned {
                number,
                t,
                next,
                h,
                begin: mesh.begin(t, h),
                impulses: mesh.impulses_in(t, next, is_last),
            };
            let has_impulses = !planned.impulses.is_empty();
            recorder.begin(stepper.model(), number, (t, h), &state, has_impulses);
            let passed = self.model.guarded(|| {
                let left = pieces.pass(stepper, planned, &mut state, &mut recorder)?;
                if left == Left::Done {
                    recorder.end(stepper.model(), number, is_last, next, &state);
                }
                Ok(left)
            });
            let passed = passed.unwrap_or_else(|_| {
                let (kind, piece) = (RunErrorKind::panicked(t), None);
                Err(Box::new(Broken { kind, piece }))
            });
            match passed {
                Ok(Left::Done) => {}
                Ok(Left::Stopped) => break,
                Err(broken) => {
                    recorder.fail(stepper.model(), number, &broken);
                    failure = Some(broken.kind);
                    break;
                }
            }
            bar.advance();
        }
        let mut motion = recorder.into_motion(stepper, &state);
        if pieces.is_changed()
            && let Err(error) = stepper.set_model(self.model.clone())
        {
            failure.get_or_insert(RunErrorKind::Element(error));
        }
        motion.set_events(pieces.events.met);
        match failure {
            None => Ok(motion),
            Some(kind) => Err(RunError::new(kind, motion)),
        }
    }

    /// What passes elements, with a look at events.
    fn pieces(&self, stepper: &Stepper<'m, M, N>) -> Result<Pieces<'m, M, N>, RunErrorKind> {
        let chosen = (stepper.element(), stepper.control());
        let events = Events::new(self.model.clone(), self.remodel, &self.events, chosen)?;
        Ok(Pieces::new(self.model.clone(), events))
    }

    /// Whether the run can begin at `start`.
    fn check_start(&self, start: &State<N>) -> Result<(), RunErrorKind> {
        match &self.refusal {
            Some(refusal) => Err(refusal.clone()),
            None => check_start(start),
        }
    }

    /// The elements of a run and its stepper, if all arguments are good.
    fn prepare(
        &self,
        start: &State<N>,
        span: &Range<f64>,
    ) -> Result<(Mesh<N>, Stepper<'m, M, N>), RunErrorKind> {
        self.check_start(start)?;
        let mesh = self.mesh(span)?;
        if let Some((_, _, h)) = mesh.elements().next() {
            check_constraints(&*self.model, span.start, h, start)?;
        }
        let stepper = Stepper::sharing(self.model.clone(), self.chosen_element(), self.control);
        Ok((mesh, stepper.map_err(RunErrorKind::Element)?))
    }

    /// The states that follow `start`, one a step, without end and in constant memory; elements end at [breaks](Self::break_at), as in [`run`](Self::run). After an error the iterator
    /// is finished. [`Steps::warnings`] tells what is doubtful about the steps so far.
    ///
    /// A step in which an [event](Self::on) changes the state or a parameter has two more nodes, with the states before and after; after the node at which an event stops the run the
    /// iterator is finished. [`Steps::events`] tells those of the last step.
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
    ///         break;
    ///     }
    /// }
    /// # Ok(())
    /// # }
    /// ```
    pub fn steps(&self, start: State<N>, t0: f64) -> Steps<'m, M, N> {
        let new = |beginning| {
            let (model, impulses) = (self.model.clone(), self.impulses.clone());
            Steps::new(model, beginning, start, t0, impulses, self.again())
        };
        let begun = self.model.guarded(|| new(self.endless(&start, t0)));
        begun.unwrap_or_else(|_| new(Err(RunErrorKind::panicked(t0))))
    }

    /// The beginning of a course without an end.
    fn endless(&self, start: &State<N>, t0: f64) -> Beginning<'m, M, N> {
        let step = self.step.unwrap_or(f64::NAN);
        self.check_start(start)?;
        check_constraints(&*self.model, t0, step, start)?;
        if !t0.is_finite() {
            return Err(RunErrorKind::Span {
                start: t0,
                end: f64::INFINITY,
            });
        }
        let elements = Endless::new(t0, step, &self.breaks)?;
        let stepper = Stepper::sharing(self.model.clone(), self.chosen_element(), self.control);
        let stepper = self.cutting(stepper.map_err(RunErrorKind::Element)?);
        if self.events.is_empty() {
            return Ok((stepper.ends_only(), elements, None));
        }
        let pieces = self.pieces(&stepper)?;
        Ok((stepper, elements, Some(pieces)))
    }

    /// How elements are solved.
    pub(crate) fn with_control(self, control: Control) -> Self {
        Self { control, ..self }
    }

    pub(crate) fn model(&self) -> &M {
        &self.model
    }

    /// With what elements are looked at a second time.
    fn again(&self) -> Again<'m, M> {
        Again {
            model: self.model.clone(),
            element: self.chosen_element(),
            control: self.control,
            at_kinks: self.at_kinks == Some(true),
        }
    }

    fn chosen_element(&self) -> Element {
        self.element.unwrap_or_else(|| Element::from(Mixed::<4>))
    }

    fn mesh(&self, span: &Range<f64>) -> Result<Mesh<N>, RunErrorKind> {
        if let Some(nodes) = &self.nodes {
            return Mesh::through(span, nodes, &self.breaks, &self.impulses);
        }
        let step = self.step.unwrap_or((span.end - span.start).abs() / 1000.0);
        Mesh::new(span, step, &self.breaks, &self.impulses)
    }
}

/// Whether the energy of a model is known to be conserved, and a jump tells of a step that is too long: linear models have steps of their own kind of error.
pub(crate) const fn conserves_energy<M: Model<N>, const N: usize>() -> bool {
    let facts = M::FACTS;
    !(facts.time_dependent || facts.forced || facts.linear) && M::CONSTRAINTS.is_empty()
}

/// Refuses start values that are not finite.
pub(crate) fn check_start<const N: usize>(state: &State<N>) -> Result<(), RunErrorKind> {
    for (coordinate, (&q, &p)) in state.q.iter().zip(&state.p).enumerate() {
        if !(q.is_finite() && p.is_finite()) {
            return Err(RunErrorKind::Start { coordinate, q, p });
        }
    }
    Ok(())
}

/// Refuses a state from which a run cannot go on.
fn check_restart<M: Model<N>, const N: usize>(
    model: &M,
    time: f64,
    h: f64,
    state: &State<N>,
) -> Result<(), RunErrorKind> {
    check_start(state)?;
    check_constraints(model, time, h, state)
}

/// Refuses a start that is not on the constraints.
pub(crate) fn check_constraints<M: Model<N>, const N: usize>(
    model: &M,
    time: f64,
    h: f64,
    start: &State<N>,
) -> Result<(), RunErrorKind> {
    if const { M::CONSTRAINTS.is_empty() } {
        return Ok(());
    }
    let v = constrained::velocity_of(model, time, &start.q, &start.p, &[0.0; N]);
    let Ok(v) = v else {
        // The first element says why.
        return Ok(());
    };
    let residuals = constrained::residuals(model, time, &start.q, &v, h);
    let holds = |one: &Residual| one.relative() <= constrained::START_TOLERANCE;
    if residuals.iter().all(holds) {
        Ok(())
    } else {
        Err(RunErrorKind::Inconsistent { time, residuals })
    }
}
