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
pub(crate) mod mesh;
mod progress;
mod sensitive;
mod steps;
mod watch;

use crate::error::{RunError, RunErrorKind};
use crate::linearised::Linearised;
use crate::motion::Motion;
use events::{Cut, Events, On, Passage};
use family::Runs;
use follow::{Follow, Nobody, Passed};
use mesh::{Endless, Mesh};
use nalgebra::DMatrix;
use std::convert::identity;
use std::ops::Range;
use std::sync::Arc;
use tfe_runtime::constrained::{self, Residual};
use tfe_runtime::length::Declared;
use tfe_runtime::step::{Control, Impulse, Stepper};

use tfe_runtime::{Element, Mixed, Model, Share, Solve, State};
use watch::resolution::{Examined, Resolution};
use watch::{Recorded, Watch};

pub use accurate::Accurate;
pub(crate) use checkpoint::Reached;
pub use checkpoint::{Checkpoint, FamilyCheckpoint};
pub use events::{Act, Crossing, Event, Occurrence};
pub use held::{Held, HeldNode};
pub use steps::Steps;
pub use watch::Warning;
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

    /// What the iteration inside an element may leave, relative to the state: the rest of a geometric series, extrapolated from its last two increments. Elements of a run leave errors of the
    /// same sign, so that they add up; below some 1e-15 all values do the same, since roundings end the iteration. The default iterates to round-off; above 1e-14
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

    /// Does `act` whenever the event or output `name` of the model changes its sign in the direction of `crossing`; [`Motion::events`] lists what was met. Of several events the run does
    /// what is to be done in the order of time.
    ///
    /// Times are those of an element that ends at the event, so that they are as accurate as nodes. An element ends there too where the state changes: two nodes have that
    /// time then, with the states before and after. None is missed: where an output cannot change its sign on an element's polynomial is proved by interval arithmetic, and what is left is
    /// searched (`docs/theory.md` §10.8). Pairs closer than 10⁻⁶ of an element may be, and those of functions given to [inputs](Self::input), which are known at samples. A value that
    /// touches zero without changing its sign is no event.
    ///
    /// [`run`](Self::run) looks for events; [`steps`](Self::steps), [`run_linearised`](Self::run_linearised) and runs with an [`accuracy`](Self::accuracy) refuse them.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// /// A ball above the ground.
    /// #[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, event(impact) = y)]
    /// struct Ball { m: f64, g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Ball { m: 0.1, g: 9.81 };
    /// let motion = Simulation::new(&ball)
    ///     .step(0.01)
    ///     .on("impact", Crossing::Falling, |event| Act::Restart(event.state_with_velocity([-0.8 * event.v[0]])))
    ///     .run(ball.state([1.0], [0.0]), 0.0..2.0)?;
    /// let first = (2.0 / 9.81_f64).sqrt();
    /// assert!((motion.events()[0].t - first).abs() < 1e-15);
    /// assert!((motion.events()[1].t - 2.6 * first).abs() < 1e-14);
    /// assert!(motion.states().iter().all(|node| node.q[0] > -1e-15));
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn on(
        mut self,
        name: impl Into<String>,
        crossing: Crossing,
        act: impl Fn(&Occurrence<'_, N>) -> Act<N> + Send + Sync + 'm,
    ) -> Self {
        self.events.push(On {
            name: name.into(),
            crossing,
            act: Arc::new(act),
        });
        self
    }

    /// Refuses events where nothing looks for them.
    fn refuse_events(&self, call: &'static str) -> Result<(), RunErrorKind> {
        if self.events.is_empty() {
            Ok(())
        } else {
            Err(RunErrorKind::EventsUnsupported { call })
        }
    }

    /// Whether steps are cut where a force has a kink or a jump: where the argument of an `abs` or `sign`, the condition of a `select`, or the difference of the arguments
    /// of a `min` or `max` changes its sign, in the state or in time (`docs/theory.md` §10.7). Elements keep their order then, and the run stays on the grid asked for;
    /// [`Statistics::kinks`](crate::Statistics::kinks) counts the crossings. A motion that would slide along a jump is an error, [`StepError::Slides`](crate::runtime::StepError::Slides).
    ///
    /// [`run`](Self::run), [`steps`](Self::steps) and [`run_estimated`](Self::run_estimated) do so only if asked, runs with an [`accuracy`](Self::accuracy) unless forbidden;
    /// [`run_linearised`](Self::run_linearised) never does.
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

    /// Runs over the span as [`run`](Self::run) does, and keeps the transition matrix of every element with the motion.
    ///
    /// A matrix costs a factorisation of the element's tangent and 2N solutions with it: half a step for one coordinate, some twenty steps
    /// for twenty coordinates that a step iterates without Newton's method. Impulses are constant, so that they enter through the
    /// motion only. The example is at [`Linearised`].
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run); [`RunErrorKind::Transition`] too where an element has no transition matrix.
    pub fn run_linearised(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Linearised<N>, RunError<N>> {
        if let Err(kind) = self.refuse_events("run_linearised") {
            let motion = Motion::from_start(&*self.model, span.start, &start);
            return Err(RunError::new(kind, motion));
        }
        let mut transitions = Vec::new();
        let mut entries = vec![0.0; 4 * N * N];
        let mut starts = Vec::new();
        let follower = |stepper: &mut Stepper<'m, M, N>, passed: &Passed<'_, N>| {
            stepper.transition(&mut entries)?;
            transitions.push(DMatrix::from_row_slice(2 * N, 2 * N, &entries));
            if const { !M::CONSTRAINTS.is_empty() } {
                starts.push((passed.start, *passed.before));
            }
            Ok(())
        };
        let motion = self.drive(start, &span, identity, follower)?;
        Ok(Linearised::new(&*self.model, motion, transitions, &starts))
    }

    /// Runs over the span, followed by `follower`.
    fn drive(
        &self,
        start: State<N>,
        span: &Range<f64>,
        ready: impl FnOnce(Stepper<'m, M, N>) -> Stepper<'m, M, N>,
        follower: impl Follow<'m, M, N>,
    ) -> Result<Motion<N>, RunError<N>> {
        let (mesh, stepper) = match self.prepare(&start, span) {
            Ok(prepared) => prepared,
            Err(kind) => {
                let motion = Motion::from_start(&*self.model, span.start, &start);
                return Err(RunError::new(kind, motion));
            }
        };
        let motion = Motion::from_start(&*self.model, span.start, &start);
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
        // A run that was stopped has no grid to go on with.
        if mesh.end().is_some_and(|end| end != last.t) {
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
        mut motion: Motion<N>,
        start: &State<N>,
        (mesh, done): (&Mesh<N>, usize),
        stepper: &mut Stepper<'m, M, N>,
        mut follower: impl Follow<'m, M, N>,
    ) -> Result<Motion<N>, RunError<N>> {
        follower.recorded(motion.last());
        let mut watch = Watch::new(self.chosen_element());
        let mut resolution = Resolution::new(&*self.model, self.chosen_element(), self.control);
        let conserves = const { conserves_energy::<M, N>() };
        let mut is_conserved = conserves;
        watch.pass(recorded(&motion, false));
        if let Some(velocity) = motion.velocities().last() {
            watch.weigh(&*self.model, motion.last().t, (&start.q, velocity));
        }
        let mut state = *start;
        let mut bar = progress::Bar::new(self.progress, mesh.steps() - done);
        let mut failure = None;
        let chosen = (self.chosen_element(), self.control);
        let mut events = match Events::new(&*self.model, &self.events, chosen) {
            Ok(events) => events,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let keeps = self.record_every == 1;
        // Of an element that was looked into and is not kept.
        let mut spare = None;
        'run: for (element, (t, next, h)) in mesh.elements().enumerate().skip(done) {
            let last = element + 1 == mesh.steps();
            watch.look(&*self.model, element, (t, h), &state);
            let impulses = mesh.impulses_in(t, next, last);
            is_conserved &= impulses.is_empty();
            events.begin(h);
            // What is left of the element behind its last event.
            let (mut from, mut length) = (t, h);
            loop {
                let before = state;
                let begin = if from == t { mesh.begin(t, h) } else { from };
                let ahead = |impulse: &&Impulse<N>| {
                    from == t || h.signum() * impulse.time >= h.signum() * from
                };
                let behind = impulses.iter().take_while(|one| !ahead(one)).count();
                let impulses = &impulses[behind..];
                let step = stepper.advance(begin, length, &mut state, impulses);
                let step = step.map_err(|source| RunErrorKind::Solve {
                    element,
                    time: from,
                    step: length,
                    source,
                });
                // Before the matrix, which needs the same memory.
                let dense = ((keeps || !events.is_empty()) && step.is_ok())
                    .then(|| stepper.dense_in(spare.take(), from, next));
                let passed = Passed {
                    start: from,
                    before: &before,
                    end: next,
                    after: &state,
                };
                let arc = dense.as_ref().map(|dense| Passage {
                    t: from,
                    h: length,
                    before: &before,
                    after: &state,
                    dense,
                    impulses,
                });
                let looked = step.and_then(|()| match &arc {
                    Some(arc) if !events.is_empty() => events.look(arc),
                    _ => Ok(None),
                });
                let followed = looked.and_then(|cut| {
                    let followed = match (&cut, &arc) {
                        (Some(cut), Some(arc)) => match events.severed(arc, cut, impulses) {
                            Some(severed) => follower.cut(&severed),
                            None => Ok(()),
                        },
                        _ => follower.passed(stepper, &passed),
                    };
                    followed.map_err(|source| RunErrorKind::Transition {
                        element,
                        time: from,
                        step: length,
                        source,
                    })?;
                    Ok(cut)
                });
                let cut = match followed {
                    Ok(cut) => cut,
                    Err(kind) => {
                        watch.examine(&*self.model, element, (from, length), &before);
                        if motion.last().t != from {
                            motion.record(&*self.model, from, &before);
                        }
                        failure = Some(kind);
                        break 'run;
                    }
                };
                let Some(cut) = cut else {
                    if impulses.is_empty() {
                        let examined = Examined {
                            t: from,
                            h: length,
                            before: &before,
                            after: &state,
                        };
                        resolution.look(stepper.statistics(), examined);
                    }
                    match dense {
                        Some(dense) if keeps => motion.keep_element(dense),
                        unneeded => spare = unneeded,
                    }
                    if last || (element + 1) % self.record_every == 0 {
                        motion.record(&*self.model, next, &state);
                        follower.recorded(motion.last());
                        watch.pass(recorded(&motion, is_conserved));
                        is_conserved = conserves;
                    }
                    break;
                };
                is_conserved = false;
                let Cut {
                    t: time,
                    at,
                    inside,
                    after,
                    ..
                } = cut;
                if let Some(dense) = inside.filter(|_| keeps) {
                    motion.keep_element(dense);
                }
                if motion.last().t != time {
                    motion.record(&*self.model, time, &at);
                    follower.recorded(motion.last());
                }
                follower.acted();
                let Some(after) = after else {
                    state = at;
                    break 'run;
                };
                if let Err(kind) = check_restart(&*self.model, time, length, &after) {
                    failure = Some(kind);
                    break 'run;
                }
                motion.record(&*self.model, time, &after);
                follower.recorded(motion.last());
                state = after;
                if time == next {
                    break;
                }
                length -= time - from;
                from = time;
            }
            bar.advance();
        }
        watch.add(resolution.warning(&state));
        motion.set_statistics(*stepper.statistics());
        motion.set_warnings(watch.into_warnings());
        motion.set_events(events.met);
        match failure {
            None => Ok(motion),
            Some(kind) => Err(RunError::new(kind, motion)),
        }
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
    /// is finished. There are no [warnings](Motion::warnings).
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
        let step = self.step.unwrap_or(f64::NAN);
        let ready = self.check_start(&start).and_then(|()| {
            self.refuse_events("steps")?;
            check_constraints(&*self.model, t0, step, &start)?;
            if !t0.is_finite() {
                return Err(RunErrorKind::Span {
                    start: t0,
                    end: f64::INFINITY,
                });
            }
            let elements = Endless::new(t0, step, &self.breaks)?;
            let stepper = Stepper::sharing(self.model.clone(), self.chosen_element(), self.control)
                .map_err(RunErrorKind::Element)?;
            Ok((self.cutting(stepper).ends_only(), elements))
        });
        Steps::new(ready, start, t0, self.impulses.clone())
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

fn recorded<const N: usize>(motion: &Motion<N>, is_conserved: bool) -> Recorded {
    let (energy, action) = motion.last_energy();
    Recorded {
        time: motion.last().t,
        energy,
        action,
        is_conserved,
    }
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
