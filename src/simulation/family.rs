//! Runs of models of run-time length.

use super::accurate::repeatable::{Broken, Passing};
use super::course::{Course, Leg};
use super::mesh::{Endless, Mesh, is_same};
use super::progress;
use super::watch::{Recorded, Watch};
use crate::error::RunErrorKind;
use crate::motion::family::{FamilyMotion, FamilyNode};
use crate::motion::{FamilyCheckpoint, Reached};
use std::error::Error;
use std::fmt;
use std::ops::{ControlFlow, Range};
use tfe_runtime::family::{FamilyError, FamilyModel, FamilyState, FamilyStepper, FamilySuspended};
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Mixed, Solve};

/// A run to be of a model of run-time length; made by [`Simulation::new`](crate::Simulation::new).
///
/// A family costs the same to compile at any length. A step takes time and memory linear in the number of coordinates and terms: one fixed-point iteration for the forces
/// at all points of the element, four points to a register.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(
///     coordinates(q[n]),
///     lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3),
/// )]
/// struct Chain { n: usize, m: f64, k: f64, a: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let chain = Chain { n: 100, m: 1.0, k: 1.0, a: 0.25 };
/// let q: Vec<f64> = (0..chain.n).map(|i| (0.03 * i as f64).cos()).collect();
/// let start = chain.state(q, vec![0.0; chain.n]);
/// let motion = Simulation::new(&chain)
///     .element(Mixed::<4>)
///     .step(0.1)
///     .run(start, 0.0..10.0)?;
/// assert!(motion.energy_error() < 1e-7); // order 6 at this step
/// let total: f64 = motion.last().p.iter().sum();
/// assert!(total.abs() < 1e-12); // no force from outside
/// # Ok(())
/// # }
/// ```
///
/// Without the feature `sparse` the kinetic energy must be ½ Σ m v² with constant masses, one for each coordinate; the potential energy and the forces may be any. With it a
/// Lagrangian may have any kinetic energy and holonomic constraints: `constraint(rod[i in 0..n-1]) = …`.
#[derive(Debug)]
pub struct FamilySimulation<'m, M> {
    pub(super) model: &'m M,
    /// The default where it is not chosen.
    pub(super) element: Option<Element>,
    pub(super) step: Option<f64>,
    pub(super) nodes: Option<Vec<f64>>,
    pub(super) control: Control,
    record_every: usize,
    pub(super) breaks: Vec<f64>,
    /// Times, which are breaks as well, and a number for each coordinate.
    impulses: Vec<(f64, Vec<f64>)>,
    pub(super) progress: bool,
}

// Not derived: the model is borrowed, it need not be `Clone`.
impl<M> Clone for FamilySimulation<'_, M> {
    fn clone(&self) -> Self {
        Self {
            nodes: self.nodes.clone(),
            breaks: self.breaks.clone(),
            impulses: self.impulses.clone(),
            ..*self
        }
    }
}

impl<'m, M: FamilyModel> FamilySimulation<'m, M> {
    /// A run of `model` with the defaults: what [`Simulation::new`](crate::Simulation::new) gives, for code that is generic over the model.
    pub fn new(model: &'m M) -> Self {
        Self {
            model,
            element: None,
            step: None,
            nodes: None,
            control: Control::default(),
            record_every: 1,
            breaks: Vec::new(),
            impulses: Vec::new(),
            progress: false,
        }
    }

    /// The element: `Mixed::<4>`, `Primal::<3>.reduced()`, `Element::mixed(n)`, …; without the feature `sparse` those that are Runge–Kutta methods, with constraints those of them
    /// with Gauss points.
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
    #[must_use]
    pub fn nodes(mut self, times: impl IntoIterator<Item = f64>) -> Self {
        self.nodes = Some(times.into_iter().collect());
        self
    }

    /// What the iteration inside an element may leave, relative to the state. It is judged by the rest of the geometric series of its increments, a fixed point by a 64th of that. Elements of a
    /// run leave errors of the same sign, so that they add up; below some 1e-15 all values do the same, since roundings end the iteration. The default iterates to round-off.
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

    /// How the element's equations are solved. `Solve::Auto`, the default, begins with the fixed point; with the feature `sparse`, steps that contract badly go to Newton's
    /// method with a sparse factorisation, without it they are errors, and so is `Solve::Newton`.
    #[must_use]
    pub fn solver(mut self, solve: Solve) -> Self {
        self.control.solve = solve;
        self
    }

    /// Records every `k`-th node (and always the first and the last). With `k` > 1 the elements' polynomials are not kept, so a long run takes
    /// little memory but [`FamilyMotion::at`] knows the recorded nodes only. 0 counts as 1.
    #[must_use]
    pub fn record_every(mut self, k: usize) -> Self {
        self.record_every = k.max(1);
        self
    }

    /// Makes an element end at `time`: where a force jumps, an element across the jump would lose its order.
    #[must_use]
    pub fn break_at(mut self, time: f64) -> Self {
        self.breaks.push(time);
        self
    }

    /// Adds an impulse: a generalized force of the given time integral, one number for each coordinate, that acts at one instant. An element ends there, and the node shows the momentum
    /// before it. One at the start of the span acts at once, one at its end on what [`resume`](Self::resume) goes on with. Models with constraints, and runs with
    /// an estimate of their error, refuse impulses: [`RunErrorKind::Unsupported`].
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(
    ///     coordinates(q[n]),
    ///     lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2),
    /// )]
    /// struct Chain { n: usize }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let chain = Chain { n: 50 };
    /// let mut blow = vec![0.0; 50];
    /// blow[0] = 1.5;
    /// let motion = Simulation::new(&chain)
    ///     .step(0.1)
    ///     .impulse(1.0, blow)
    ///     .run(chain.state([0.0; 50], [0.0; 50]), 0.0..5.0)?;
    /// assert!(motion.states()[10].p.iter().all(|p| *p == 0.0)); // at t = 1, before it
    /// let total: f64 = motion.last().p.iter().sum();
    /// assert!((total - 1.5).abs() < 1e-14);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn impulse(mut self, time: f64, impulse: impl Into<Vec<f64>>) -> Self {
        self.breaks.push(time);
        self.impulses.push((time, impulse.into()));
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
    /// What is doubtful about the result without being an error is in [`FamilyMotion::warnings`].
    ///
    /// # Errors
    /// [`FamilyRunError`] says where and why the run stopped and holds the motion so far.
    pub fn run(
        &self,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<FamilyMotion, FamilyRunError> {
        let refused = |kind| self.refused(kind, span.start, &start);
        let (stepper, _) = self.stepper(span.start, &start).map_err(refused)?;
        let mesh = self.mesh(&span).map_err(refused)?;
        let place = (&mesh, 0, span.start);
        self.drive_on((span.start, &start), place, stepper)
    }

    /// Runs over what is left of a mesh, and leaves a checkpoint.
    pub(super) fn drive_on(
        &self,
        start: (f64, &FamilyState),
        (mesh, done, origin): (&Mesh<0>, usize, f64),
        mut stepper: FamilyStepper<'m, M>,
    ) -> Result<FamilyMotion, FamilyRunError> {
        let motion = self.drive_from(start, (mesh, done), &mut stepper, &mut |_, _, _, _| {
            ControlFlow::Continue(())
        });
        let mut motion = motion.map_err(|broken| FamilyRunError::new(broken.0, broken.1))?;
        let last = motion.last();
        let checkpoint = FamilyCheckpoint {
            reached: Reached::new(origin, self.step, mesh, last.t),
            state: last.state(),
            stepper: stepper.suspend(),
        };
        motion.set_checkpoint(checkpoint);
        Ok(motion)
    }

    pub(super) fn refused(
        &self,
        kind: RunErrorKind,
        t: f64,
        start: &FamilyState,
    ) -> FamilyRunError {
        FamilyRunError::new(kind, FamilyMotion::empty(self.model, t, start))
    }

    pub(super) fn chosen_element(&self) -> Element {
        self.element.unwrap_or_else(|| Element::from(Mixed::<4>))
    }

    pub(super) fn mesh(&self, span: &Range<f64>) -> Result<Mesh<0>, RunErrorKind> {
        let (first, last) = (span.start.min(span.end), span.start.max(span.end));
        for (time, impulse) in &self.impulses {
            let is_finite = impulse.iter().all(|one| one.is_finite());
            if !(is_finite && first <= *time && *time <= last) {
                return Err(RunErrorKind::Impulse { time: *time });
            }
        }
        if let Some(nodes) = &self.nodes {
            return Mesh::through(span, nodes, &self.breaks, &[]);
        }
        let step = self.step.unwrap_or((span.end - span.start).abs() / 1000.0);
        Mesh::new(span, step, &self.breaks, &[])
    }

    /// Runs over a mesh with a stepper at rest, and shows the end of every element to `passed`.
    pub(super) fn drive_over(
        &self,
        start: (f64, &FamilyState),
        mesh: &Mesh<0>,
        stepper: &mut FamilyStepper<'m, M>,
        passed: &mut Passing<'_, FamilyStepper<'m, M>, FamilyState>,
    ) -> Result<FamilyMotion, Broken<FamilyMotion>> {
        self.drive_from(start, (mesh, 0), stepper, passed)
    }

    /// The same after the elements that are done.
    fn drive_from(
        &self,
        (t0, start): (f64, &FamilyState),
        (mesh, done): (&Mesh<0>, usize),
        stepper: &mut FamilyStepper<'m, M>,
        passed: &mut Passing<'_, FamilyStepper<'m, M>, FamilyState>,
    ) -> Result<FamilyMotion, Broken<FamilyMotion>> {
        let velocity = stepper.velocity(t0, start);
        let mut motion = FamilyMotion::from_start(self.model, t0, start, velocity);
        let mut bar = progress::Bar::new(self.progress, mesh.steps() - done);
        let mut failure = None;
        let mut state = start.clone();
        let mut watch = Watch::new(self.chosen_element());
        watch.pass(recorded::<M>(&motion, false));
        let conserves = self.impulses.is_empty();
        for (element, (t, next, h)) in mesh.elements().enumerate().skip(done) {
            kick(&self.impulses, t, &mut state);
            if let Err(source) = stepper.advance(mesh.begin(t, h), h, &mut state) {
                if motion.last().t != t {
                    motion.record(self.model, t, &state, stepper.velocity(t, &state));
                }
                failure = Some(RunErrorKind::Solve {
                    element,
                    time: t,
                    step: h,
                    source,
                });
                break;
            }
            if self.record_every == 1 {
                motion.keep_element(stepper.dense(t, next));
            }
            let goes_on = passed(stepper, next, &state, 0);
            let last = element + 1 == mesh.steps();
            if last || (element + 1) % self.record_every == 0 {
                motion.record(self.model, next, &state, stepper.velocity(next, &state));
                watch.pass(recorded::<M>(&motion, conserves));
            }
            if goes_on.is_break() {
                break;
            }
            bar.advance();
        }
        motion.set_statistics(*stepper.statistics());
        motion.set_warnings(watch.into_warnings());
        match failure {
            None => Ok(motion),
            Some(kind) => Err(Box::new((kind, motion))),
        }
    }

    /// The states that follow `start`, one a step, without end and in constant memory. After an error the iterator is finished.
    pub fn steps(&self, start: FamilyState, t0: f64) -> FamilySteps<'m, M> {
        let step = self.step.unwrap_or(f64::NAN);
        let stepper = self.stepper(t0, &start).and_then(|(stepper, _)| {
            if !t0.is_finite() {
                let (start, end) = (t0, f64::INFINITY);
                return Err(RunErrorKind::Span { start, end });
            }
            Ok((stepper, Endless::new(t0, step, &self.breaks)?))
        });
        FamilySteps {
            course: Course::new(stepper),
            state: start,
            impulses: self.impulses.clone(),
        }
    }

    /// A stepper and the velocity at the start, if model, element and start are good.
    pub(super) fn stepper(
        &self,
        t: f64,
        start: &FamilyState,
    ) -> Result<(FamilyStepper<'m, M>, Vec<f64>), RunErrorKind> {
        self.check(start)?;
        self.check_impulses()?;
        let stepper = FamilyStepper::new(self.model, self.chosen_element(), self.control);
        let mut stepper = stepper.map_err(RunErrorKind::Family)?;
        // A run records velocities: what has none is refused before it begins.
        let velocity = stepper.velocity(t, start).map_err(RunErrorKind::Family)?;
        Ok((stepper, velocity))
    }

    /// A stepper that goes on, if model, element and state are good.
    pub(super) fn resumed_stepper(
        &self,
        t: f64,
        state: &FamilyState,
        suspended: FamilySuspended,
    ) -> Result<FamilyStepper<'m, M>, RunErrorKind> {
        self.check(state)?;
        self.check_impulses()?;
        let (element, control) = (self.chosen_element(), self.control);
        let stepper = FamilyStepper::resume(self.model, element, control, suspended);
        let mut stepper = stepper.map_err(RunErrorKind::Family)?;
        stepper.velocity(t, state).map_err(RunErrorKind::Family)?;
        Ok(stepper)
    }

    /// Whether a call may compare runs, which look for errors of momenta at nodes: at impulses they have two values there.
    pub(super) fn without_impulses(&self, call: &'static str) -> Result<(), RunErrorKind> {
        let of = "runs of models of run-time length with impulses";
        match self.impulses.is_empty() {
            true => Ok(()),
            false => Err(RunErrorKind::Unsupported { call, of }),
        }
    }

    /// Whether the impulses are some that the model can take.
    fn check_impulses(&self) -> Result<(), RunErrorKind> {
        if const { M::CONSTRAINED } && !self.impulses.is_empty() {
            return Err(RunErrorKind::Unsupported {
                call: "impulse",
                of: "models of run-time length with constraints",
            });
        }
        let expected = self.model.len();
        for (_, impulse) in &self.impulses {
            if impulse.len() != expected {
                return Err(RunErrorKind::Family(FamilyError::StateLength {
                    vector: "of an impulse",
                    length: impulse.len(),
                    expected,
                }));
            }
        }
        Ok(())
    }

    /// Whether model and start are good.
    fn check(&self, start: &FamilyState) -> Result<(), RunErrorKind> {
        self.model.check().map_err(RunErrorKind::Family)?;
        // Before memory is asked for: a wrong length may be any number.
        let expected = self.model.len();
        for (vector, values) in [("q", &start.q), ("p", &start.p)] {
            let length = values.len();
            if length != expected {
                return Err(RunErrorKind::Family(FamilyError::StateLength {
                    vector,
                    length,
                    expected,
                }));
            }
        }
        for (coordinate, (&q, &p)) in start.q.iter().zip(&start.p).enumerate() {
            if !(q.is_finite() && p.is_finite()) {
                return Err(RunErrorKind::Start { coordinate, q, p });
            }
        }
        Ok(())
    }
}

/// What impulses at this time make of momenta.
fn kick(impulses: &[(f64, Vec<f64>)], t: f64, state: &mut FamilyState) {
    for (_, impulse) in impulses.iter().filter(|(time, _)| is_same(*time, t)) {
        for (p, change) in state.p.iter_mut().zip(impulse) {
            *p += change;
        }
    }
}

/// The last node of a motion, behind another one or not.
fn recorded<M: FamilyModel>(motion: &FamilyMotion, is_behind: bool) -> Recorded {
    let facts = M::FACTS;
    let conserves = !(facts.time_dependent || facts.forced || facts.linear || M::CONSTRAINED);
    let (energy, action) = motion.last_energy();
    Recorded {
        time: motion.last().t,
        energy,
        action,
        is_conserved: is_behind && conserves,
    }
}

/// The endless sequence of states of [`FamilySimulation::steps`].
#[derive(Debug)]
pub struct FamilySteps<'m, M> {
    course: Course<FamilyStepper<'m, M>>,
    state: FamilyState,
    impulses: Vec<(f64, Vec<f64>)>,
}

impl<M: FamilyModel> Iterator for FamilySteps<'_, M> {
    type Item = Result<FamilyNode, RunErrorKind>;

    fn next(&mut self) -> Option<Self::Item> {
        let (state, impulses) = (&mut self.state, &self.impulses);
        let advance = |stepper: &mut FamilyStepper<'_, M>, leg: &Leg| {
            let (begin, _) = leg.nodes;
            kick(impulses, begin, state);
            stepper
                .advance(leg.begin, leg.h, state)
                .map_err(|source| leg.failed(source))?;
            let (_, next) = leg.nodes;
            let velocity = stepper.velocity(next, state);
            Ok(FamilyNode::new(next, state.clone(), velocity))
        };
        self.course.next(advance, |_| ())
    }
}

/// A run of a family that stopped before its end: why, and the motion up to the last good state.
#[derive(Clone, Debug)]
pub struct FamilyRunError {
    kind: RunErrorKind,
    partial: Box<FamilyMotion>,
}

impl FamilyRunError {
    pub(super) fn new(kind: RunErrorKind, partial: FamilyMotion) -> Self {
        Self {
            kind,
            partial: Box::new(partial),
        }
    }

    /// Why the run stopped.
    pub fn kind(&self) -> &RunErrorKind {
        &self.kind
    }

    /// The motion up to the last good state; the start alone, without energy, where the run never began.
    pub fn partial(&self) -> &FamilyMotion {
        &self.partial
    }

    /// The motion up to the last good state, by value.
    pub fn into_partial(self) -> FamilyMotion {
        *self.partial
    }
}

impl fmt::Display for FamilyRunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind.fmt(f)?;
        match self.partial.states().last() {
            Some(node) if self.partial.states().len() > 1 => {
                write!(f, "; the motion up to t = {} is in `partial()`", node.t)?;
            }
            _ => {}
        }
        for warning in self.partial.warnings() {
            write!(f, "; {warning}")?;
        }
        Ok(())
    }
}

impl Error for FamilyRunError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.kind.source()
    }
}
