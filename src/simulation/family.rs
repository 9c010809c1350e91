//! Runs of models of run-time length.

use super::accurate::repeatable::{Broken, Passing};
use super::checks::conserves_energies;
use super::mesh::{Mesh, is_same};
use super::progress;
use super::setup::Simulation;
use super::watch::{Recorded, Watch};
use crate::error::{RunError, RunErrorKind};
use crate::length::RunTimeLength;
use crate::motion::{Checkpoint, Motion, Node, Reached};
use std::ops::{ControlFlow, Range};
use tfe_runtime::family::{FamilyError, FamilyModel, FamilyState, FamilyStepper, FamilySuspended};

impl<'m, M: FamilyModel> Simulation<'m, M, 0, RunTimeLength> {
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

    /// Runs over the span, backwards where it ends before it starts. The last node is exactly at the end of the span.
    ///
    /// What is doubtful about the result without being an error is in [`Motion::warnings`].
    ///
    /// # Errors
    /// [`RunError`] says where and why the run stopped and holds the motion so far.
    pub fn run(
        &self,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<Motion<0, RunTimeLength>, RunError<0, RunTimeLength>> {
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
    ) -> Result<Motion<0, RunTimeLength>, RunError<0, RunTimeLength>> {
        let motion = self.drive_from(start, (mesh, done), &mut stepper, &mut |_, _, _, _| {
            ControlFlow::Continue(())
        });
        let mut motion = motion.map_err(|broken| RunError::new(broken.0, broken.1))?;
        let last = motion.last();
        let checkpoint = Checkpoint {
            reached: Reached::new(origin, self.step, mesh, last.t),
            state: last.state(),
            velocity: last.v.clone(),
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
    ) -> RunError<0, RunTimeLength> {
        RunError::new(kind, Motion::unasked(t, start))
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
    ) -> Result<Motion<0, RunTimeLength>, Broken<Motion<0, RunTimeLength>>> {
        self.drive_from(start, (mesh, 0), stepper, passed)
    }

    /// The same after the elements that are done.
    fn drive_from(
        &self,
        (t0, start): (f64, &FamilyState),
        (mesh, done): (&Mesh<0>, usize),
        stepper: &mut FamilyStepper<'m, M>,
        passed: &mut Passing<'_, FamilyStepper<'m, M>, FamilyState>,
    ) -> Result<Motion<0, RunTimeLength>, Broken<Motion<0, RunTimeLength>>> {
        let mut motion = Motion::starting(self.model, node(stepper, t0, start));
        let mut bar = progress::Bar::new(self.progress, mesh.steps() - done);
        let mut failure = None;
        let mut state = start.clone();
        let mut watch = Watch::new(self.chosen_element());
        watch.pass(Recorded::last_of(&motion, false));
        // Until the next impulse, and behind it.
        let mut is_conserved = const { conserves_energies::<M>() };
        for (element, (t, next, h)) in mesh.elements().enumerate().skip(done) {
            is_conserved &= !kick(&self.impulses, t, &mut state);
            if let Err(source) = stepper.advance(mesh.begin(t, h), h, &mut state) {
                if motion.last().t != t {
                    motion.record_node(self.model, node(stepper, t, &state));
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
                motion.record_node(self.model, node(stepper, next, &state));
                watch.pass(Recorded::last_of(&motion, is_conserved));
                is_conserved = const { conserves_energies::<M>() };
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
        if self.at_kinks == Some(true) && const { !M::FACTS.smooth } {
            return Err(RunErrorKind::KinksUnsupported { call: "at_kinks" });
        }
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

/// A state with its velocities; NaN where there are none.
pub(super) fn node<M: FamilyModel>(
    stepper: &mut FamilyStepper<'_, M>,
    t: f64,
    state: &FamilyState,
) -> Node<0, RunTimeLength> {
    let velocity = stepper.velocity(t, state);
    Node::of(
        t,
        state,
        velocity.unwrap_or_else(|_| vec![f64::NAN; state.q.len()]),
    )
}

/// What impulses at this time make of momenta; whether there are any.
pub(super) fn kick(impulses: &[(f64, Vec<f64>)], t: f64, state: &mut FamilyState) -> bool {
    let mut is_kicked = false;
    for (_, impulse) in impulses.iter().filter(|(time, _)| is_same(*time, t)) {
        for (p, change) in state.p.iter_mut().zip(impulse) {
            *p += change;
        }
        is_kicked = true;
    }
    is_kicked
}
