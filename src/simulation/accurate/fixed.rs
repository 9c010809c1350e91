//! Runs of models of fixed size with an estimate of their error.

use super::super::checks::check_constraints;
use super::super::events::Severed;
use super::super::follow::{Follow, Passed};
use super::super::mesh::Mesh;
use super::super::setup::Simulation;
use super::graded::Steps;
use super::repeatable::{Broken, Passing, Repeatable, trusting};
use super::{Accurate, accurate, check_accuracy, estimated};
use crate::accuracy::{Asked, Estimated};
use crate::error::{RunError, RunErrorKind};
use crate::motion::Motion;
use std::ops::{ControlFlow, Range};
use tfe_runtime::constrained::Trail;
use tfe_runtime::step::{Control, Stepper};
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{
    Element, First, Form, Model, Second, Solve, State, Statistics, StepError, constrained,
};

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    /// Picks element and step so that the estimated error is at or below `accuracy` wherever it is estimated: of coordinates over the largest coordinate, of
    /// momenta over the largest momentum, of each declared output over its largest value.
    ///
    /// An element chosen before stays, a step given before is the longest one allowed. The motion comes with its error and says what was picked and why. Two to
    /// four runs over the span are made with shorter and shorter steps, and one more that verifies the last: with an element of one node more over the same steps, which tells the
    /// error as [`run_estimated`](Self::run_estimated) does (`docs/theory.md` §14.3). What is verified is the error of the steps and of their iterations at the times of comparison; that both
    /// elements see all there is, such as a force that acts for a time much shorter than a step, is believed.
    ///
    /// Steps are equal, between breaks, for models that are conservative and do not depend on time, unless their Hamiltonian is linear in the momenta (equations of first order, p·f(q)). For others they are short where the motion is fast, if equal ones
    /// would be many and steps differ by more than three (`docs/theory.md` §14.5); [`Accurate::equal_steps`] forbids that. [Nodes](Simulation::nodes) given before are refined as a whole.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + k*cos(theta), output(height) = -cos(theta))]
    /// struct Pendulum { k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let pendulum = Pendulum { k: 1.0 };
    /// let motion = Simulation::new(&pendulum)
    ///     .accuracy(1e-8)
    ///     .run(pendulum.state([2.0], [0.0]), 0.0..10.0)?;
    /// assert!(motion.error_estimate() <= 1e-8);
    /// assert!((motion.last().q[0] - 0.713_148_180_601_379).abs() < 2e-8); // of a motion between −2 and 2
    /// assert!(motion.error_estimate_of("height").is_some());
    /// println!("{}", motion.picked().ok_or("picks always")?);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn accuracy(self, accuracy: f64) -> Accurate<Self> {
        Accurate::new(self, accuracy)
    }

    /// Runs over the span as [`run`](Self::run) does, and estimates the error at every node by a second run with an element of higher order:
    ///
    /// ```text
    /// E(t) = |y_{h, n}(t) − y_{h, n+1}(t)|                                                    (T-98)
    /// ```
    ///
    /// with the same steps and one node more; beside an element of twelve nodes, two steps for each of one of twelve. It costs a little more than another run. Where
    /// steps are far too long for the motion both runs are wrong and so is the estimate: it is large then, never small by chance at all nodes.
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + k*cos(theta))]
    /// struct Pendulum { k: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let pendulum = Pendulum { k: 1.0 };
    /// let motion = Simulation::new(&pendulum)
    ///     .element(Primal::<3>)
    ///     .step(0.1)
    ///     .run_estimated(pendulum.state([2.0], [0.0]), 0.0..10.0)?;
    /// let error = (motion.last().q[0] - 0.713_148_180_601_379).abs() / 2.0;
    /// let (_, estimate) = motion.error_estimates().last().ok_or("one a node")?;
    /// assert!(error / 2.0 < estimate && estimate < 2.0 * error.max(1e-6));
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run), of either run.
    pub fn run_estimated(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<N>>, RunError<N>> {
        let beginning = || Motion::from_start(&*self.model, span.start, &start);
        let mesh = self.prepare(&start, &span).map(|(mesh, _)| mesh);
        let mesh = mesh.map_err(|kind| RunError::new(kind, beginning()))?;
        estimated(self, (span.start, &start), &mesh)
            .map_err(|broken| RunError::new(broken.0, broken.1))
    }
}

impl<M: Model<N>, const N: usize> Accurate<Simulation<'_, M, N>> {
    /// Runs over the span with the element and the step that meet the accuracy.
    ///
    /// # Errors
    /// [`RunError`], as from [`Simulation::run`]; [`RunErrorKind::AccuracyMissed`] where no step was found that meets the accuracy, with the best motion in
    /// [`partial`](RunError::partial): a chaotic motion over a span too long, or less than roundings make.
    pub fn run(
        &self,
        start: State<N>,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<N>>, RunError<N>> {
        let run = &self.simulation;
        let run = &run.clone().at_kinks(run.at_kinks.unwrap_or(true));
        if span.start == span.end {
            let motion = run.run(start, span)?;
            let outputs = run.outputs();
            return Ok(Estimated::new(
                motion,
                Vec::new(),
                Vec::new(),
                outputs,
                None,
            ));
        }
        let refused = |kind| {
            let motion = Motion::from_start(&*run.model, span.start, &start);
            RunError::new(kind, motion)
        };
        self.check(&start, &span).map_err(refused)?;
        let impulses = run.impulses.iter().map(|one| one.time);
        let asked = Asked {
            accuracy: self.accuracy,
            span: span.clone(),
            // An impulse inside an element costs it its order.
            breaks: run.breaks.iter().copied().chain(impulses).collect(),
            element: run.element,
            longest: run.step,
            may_iterate: run.control.solve == Solve::Auto
                && const { !M::FACTS.linear && M::CONSTRAINTS.is_empty() },
            solve: run.control.solve,
            graded: None,
            in_pairs: const { !M::CONSTRAINTS.is_empty() }
                && !run.has_events()
                && !run.crosses_kinks(),
        };
        let mut facts = M::FACTS;
        // Equations of first order, written as p·f(q), conserve nothing that short and long steps could spoil.
        facts.forced |= !M::FACTS.linear && is_of_first_order(&*run.model, span.start, &start);
        let are_equal = self.equal_steps || run.has_events();
        let steps = Steps::of(&facts, are_equal, !M::CONSTRAINTS.is_empty());
        accurate(run, &start, &asked, steps).map_err(|broken| RunError::new(broken.0, broken.1))
    }

    fn check(&self, start: &State<N>, span: &Range<f64>) -> Result<(), RunErrorKind> {
        let run = &self.simulation;
        check_accuracy(self.accuracy)?;
        run.check_start(start)?;
        // Of span, breaks and impulses.
        let h = (span.end - span.start) / 1000.0;
        if run.nodes.is_some() {
            run.mesh(span)?;
        }
        Mesh::new(span, h, &run.breaks, &run.impulses)?;
        check_constraints(&*run.model, span.start, h, start)
    }
}

/// Whether H is linear in the momenta: q̇ = f(q, t) does not hold them, and ṗ = −(∂f/∂q)ᵀ p is its adjoint.
fn is_of_first_order<M: Model<N>, const N: usize>(model: &M, t: f64, start: &State<N>) -> bool {
    let (mut first, mut second) = (First::ZERO, Second::ZERO);
    let may_be = M::FORM == Form::Hamiltonian && M::FACTS.quadratic_in_z;
    if may_be {
        model.second(t, &start.q, &start.p, &mut first, &mut second);
    }
    may_be && second.zz.as_flattened().iter().all(|entry| *entry == 0.0)
}

impl<'m, M: Model<N>, const N: usize> Repeatable<N> for Simulation<'m, M, N> {
    type State = State<N>;
    type Stepper = Stepper<'m, M, N>;
    type Motion = Motion<N>;

    fn element(&self) -> Element {
        self.chosen_element()
    }

    fn control(&self) -> Control {
        self.control
    }

    fn progress(&self) -> bool {
        self.progress
    }

    fn coordinates(&self) -> usize {
        N
    }

    fn columns(&self) -> usize {
        self.model.columns()
    }

    fn outputs(&self) -> Vec<String> {
        let columns = 0..self.model.columns();
        let name = |at| self.model.column_name(at).to_string();
        columns.map(name).collect()
    }

    fn stepper(
        &self,
        element: Element,
        control: Control,
        is_recorded: bool,
    ) -> Result<Stepper<'m, M, N>, RunErrorKind> {
        let control = trusting(control);
        let stepper = Stepper::sharing(self.model.clone(), element, control)
            .map_err(RunErrorKind::Element)?;
        let stepper = self.cutting(stepper);
        Ok(
            if self.has_events() || (is_recorded && self.record_every == 1) {
                stepper
            } else {
                stepper.ends_only()
            },
        )
    }

    fn advance(
        &self,
        stepper: &mut Stepper<'m, M, N>,
        (t, next, h): (f64, f64, f64),
        mesh: &Mesh<N>,
        state: &mut State<N>,
    ) -> Result<(), StepError> {
        let impulses = mesh.impulses_in(t, next, mesh.end() == Some(next));
        // Of a panic the motion that is recorded tells, which is the first.
        let advanced =
            (self.model).guarded(|| stepper.advance(mesh.begin(t, h), h, state, impulses));
        advanced.unwrap_or(Err(StepError::NonFinite))
    }

    fn failed(&self, element: usize, at: (f64, f64), source: StepError) -> RunErrorKind {
        RunErrorKind::of_element(&*self.model, element, at, source)
    }

    fn leave(stepper: &Self::Stepper, trail: &mut Trail) {
        stepper.leave(trail);
    }

    fn foresee(stepper: &mut Self::Stepper, trail: &Trail, step: (f64, f64)) {
        stepper.foresee(trail, step);
    }

    fn set_tolerance(stepper: &mut Stepper<'m, M, N>, tolerance: f64) {
        stepper.set_tolerance(tolerance);
    }

    fn statistics(stepper: &Stepper<'m, M, N>) -> Statistics {
        *stepper.statistics()
    }

    fn take_statistics(stepper: &mut Stepper<'m, M, N>) -> Statistics {
        stepper.take_statistics()
    }

    fn row(&self, _: &mut Stepper<'m, M, N>, t: f64, state: &State<N>, row: &mut [f64]) {
        row[..N].copy_from_slice(&state.q);
        row[N..2 * N].copy_from_slice(&state.p);
        if self.model.columns() == 0 {
            return;
        }
        let z = match M::FORM {
            Form::Hamiltonian => state.p,
            Form::Lagrangian => {
                constrained::velocity_of(&*self.model, t, &state.q, &state.p, &[0.0; N])
                    .unwrap_or([f64::NAN; N])
            }
        };
        self.model.observables(t, &state.q, &z, &mut row[2 * N..]);
    }

    fn record(
        &self,
        stepper: &mut Stepper<'m, M, N>,
        mesh: &Mesh<N>,
        (t, start): (f64, &State<N>),
        passed: &mut Passing<'_, Stepper<'m, M, N>, State<N>>,
    ) -> Result<Motion<N>, Broken<Motion<N>>> {
        let mut compared = Compared {
            passed,
            acts: 0,
            last: t,
            goes_on: ControlFlow::Continue(()),
        };
        let motion = self
            .drive_over(*start, t, mesh, stepper, &mut compared)
            .map_err(|error| Box::new((error.kind().clone(), error.into_partial())))?;
        // A run that an event has stopped stays where it is.
        let (acts, last) = (compared.acts, compared.last);
        if compared.goes_on.is_break() {
            return Ok(motion);
        }
        let rest = mesh.elements().map(|(_, next, _)| next);
        let ahead = rest.filter(|next| (next - last) * (next - t).signum() > 0.0);
        for next in ahead {
            let _ = passed(stepper, next, &motion.last().state(), acts);
        }
        Ok(motion)
    }

    fn crosses_kinks(&self) -> bool {
        self.at_kinks != Some(true) && const { !M::FACTS.smooth }
    }

    fn has_events(&self) -> bool {
        !self.events.is_empty()
    }

    fn part(&self, (t0, start): (f64, &State<N>), (t, end): (f64, &State<N>)) -> Motion<N> {
        let mut motion = Motion::from_start(&*self.model, t0, start);
        if t != t0 {
            motion.record(&*self.model, t, end);
        }
        motion
    }

    fn even(&self, cuts: &[f64], step: f64) -> Result<Mesh<N>, RunErrorKind> {
        Mesh::even(cuts, step, &self.breaks, &self.impulses)
    }

    fn through(&self, nodes: &[f64]) -> Result<Mesh<N>, RunErrorKind> {
        Mesh::of_nodes(nodes, &self.breaks, &self.impulses)
    }

    fn nodes(&self) -> Option<&[f64]> {
        self.nodes.as_deref()
    }
}

/// Shows what a run is compared by.
struct Compared<'a, 'p, 'm, M, const N: usize> {
    passed: &'a mut Passing<'p, Stepper<'m, M, N>, State<N>>,
    /// Events that have cut elements.
    acts: usize,
    last: f64,
    goes_on: ControlFlow<()>,
}

impl<'m, M: Model<N>, const N: usize> Follow<'m, M, N> for Compared<'_, '_, 'm, M, N> {
    fn passed(
        &mut self,
        _: &mut Stepper<'m, M, N>,
        _: &Passed<'_, N>,
    ) -> Result<(), TransitionError> {
        Ok(())
    }

    fn cut(&mut self, _: &Severed<'_, 'm, N>) -> Result<(), TransitionError> {
        self.acts += 1;
        Ok(())
    }

    fn reached(
        &mut self,
        stepper: &mut Stepper<'m, M, N>,
        t: f64,
        state: &State<N>,
    ) -> ControlFlow<()> {
        self.last = t;
        self.goes_on = (self.passed)(stepper, t, state, self.acts);
        self.goes_on
    }
}
