//! The calls for runs with error estimates and for runs with a prescribed accuracy.

use super::super::events::Severed;
use super::super::follow::Follow;
use super::super::kind::{Chosen, Simulated};
use super::super::mesh::{Grid, Mesh};
use super::super::setup::Simulation;
use super::super::times::check_span;
use super::graded::Steps;
use super::repeatable::{At, Broken, Passing, Repeatable, trusting};
use super::{Accurate, accurate, check_accuracy, estimated};
use crate::accuracy::{Asked, Estimated};
use crate::error::{RunError, RunErrorKind};
use crate::length::Length;
use crate::motion::{Motion, Warning};
use std::ops::{ControlFlow, Range};
use tfe_runtime::constrained::Trail;
use tfe_runtime::step::Control;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{Element, Share, Solve, Statistics, StepError};

impl<M, const N: usize, L> Simulation<'_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// Asks for an accuracy: the run then chooses the element and the step size such that the estimated error is at most
    /// `accuracy`, a number between 0 and 1.
    ///
    /// The error is relative, and estimated at the times at which the runs are compared: the error of the coordinates
    /// divided by the largest coordinate, of the momenta divided by the largest momentum, and of each declared output
    /// divided by its largest value. The motion carries its estimate, and [`Estimated::picked`] says what was chosen and
    /// why.
    ///
    /// An element set before is kept, and a step size set before is the largest one allowed. Two to four runs over the
    /// span are made with shorter and shorter steps, and one more for verification: over the same steps with an
    /// element of one node more, whose difference is the estimate, as in [`run_estimated`](Self::run_estimated)
    /// (`docs/theory.md` §14.3). This verifies the discretisation error and the error of the iteration at the times of
    /// comparison. It cannot detect what both elements miss, such as a force that acts for a time much shorter than a
    /// step.
    ///
    /// Steps are equal (between breaks) for conservative models that do not depend on time, except for Hamiltonians
    /// linear in the momenta, p·f(q), which are equations of first order. Other models get shorter steps where the
    /// motion is fast, if many equal steps would be needed and the step sizes would differ by more than a factor of
    /// three (`docs/theory.md` §14.5); [`Accurate::equal_steps`] forbids this. [Nodes](Simulation::nodes) set before
    /// are refined all together.
    ///
    /// An `accuracy` below the rounding unit ε/2 = 1.1e-16 is never met: the run then returns
    /// [`RunErrorKind::AccuracyMissed`] with the best motion.
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

    /// Runs over the span as [`run`](Self::run) does, and estimates the error at every node by a second run with an
    /// element of higher order:
    ///
    /// ```text
    /// E(t) = |y_{h, n}(t) − y_{h, n+1}(t)|                                                    (T-98)
    /// ```
    ///
    /// where the second run uses the same steps and an element with one node more; an element of twelve nodes is
    /// compared with two half steps of the same element. The cost is a little more than that of two runs. If the steps
    /// are far too long for the motion, both runs are wrong and so is the estimate, but it is then large: it is not
    /// small by chance at all nodes.
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
    /// [`RunError`], as from [`run`](Self::run), of either of the two runs.
    pub fn run_estimated(
        &self,
        start: L::State,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<N, L>>, RunError<N, L>> {
        let at_start = (span.start, &start);
        let found = self.model.guarded(|| {
            let mesh = self.prepare(&start, &span).map(|(mesh, _)| mesh);
            let mesh = mesh.map_err(|kind| self.refused(kind, at_start))?;
            estimated(self, at_start, &mesh).map_err(|broken| RunError::new(broken.0, broken.1))
        });
        found.unwrap_or_else(|| Err(self.refused(RunErrorKind::panicked(span.start), at_start)))
    }

    /// The error of a run that failed before its first element.
    pub(in crate::simulation) fn refused(
        &self,
        kind: RunErrorKind,
        (t, start): (f64, &L::State),
    ) -> RunError<N, L> {
        let motion = self
            .model
            .guarded(|| self.model.first_node((t, start), None));
        let motion = motion.unwrap_or_else(|| Motion::unknown(&*self.model, t, start));
        RunError::new(kind, motion)
    }
}

impl<M, const N: usize, L> Accurate<Simulation<'_, M, N, L>>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// Runs over the span with an element and a step size that meet the accuracy.
    ///
    /// # Errors
    /// [`RunError`], as from [`Simulation::run`]. [`RunErrorKind::AccuracyMissed`] if no step size was found that
    /// meets the accuracy, for example because the motion is chaotic and the span too long, or the accuracy is below
    /// the effect of rounding; the best motion is in [`partial`](RunError::partial).
    pub fn run(
        &self,
        start: L::State,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<N, L>>, RunError<N, L>> {
        let mut run = self.simulation.clone();
        run.at_kinks.get_or_insert(true);
        let run = &run;
        let at_start = (span.start, &start);
        if span.start == span.end {
            check_accuracy(self.accuracy).map_err(|kind| run.refused(kind, at_start))?;
            let motion = run.run(start, span)?;
            let outputs = run.outputs();
            // Empty lists of errors: for the coordinates, the momenta and each output.
            let errors = vec![Vec::new(); 2 + outputs.len()];
            return Ok(Estimated::new(motion, Vec::new(), errors, outputs, None));
        }
        let found = run.model.guarded(|| self.find(run, at_start, &span));
        found.unwrap_or_else(|| Err(run.refused(RunErrorKind::panicked(span.start), at_start)))
    }

    /// The search on a span of nonzero length.
    fn find(
        &self,
        run: &Simulation<'_, M, N, L>,
        at_start: (f64, &L::State),
        span: &Range<f64>,
    ) -> Result<Estimated<Motion<N, L>>, RunError<N, L>> {
        let (_, start) = at_start;
        let checked = self.check(run, start, span);
        checked.map_err(|kind| run.refused(kind, at_start))?;
        let asked = Asked {
            accuracy: self.accuracy,
            span: span.clone(),
            // An impulse inside an element reduces the order, so elements end there.
            breaks: with_times(&run.breaks, &run.impulses, M::time_of),
            element: run.element,
            longest: run.step,
            may_iterate: run.control.solve == Solve::Auto && M::MAY_ITERATE,
            solve: run.control.solve,
            graded: None,
            in_pairs: M::IS_CONSTRAINED && !run.has_events() && !run.crosses_kinks(),
        };
        let is_of_first_order = !M::FACTS.linear && run.model.is_of_first_order(span.start, start);
        let are_equal = self.equal_steps || run.has_events();
        let may_vary = Steps::may_vary(M::FACTS, is_of_first_order) && !are_equal;
        let steps = Steps::of(may_vary, M::IS_CONSTRAINED);
        accurate(run, start, &asked, steps).map_err(|broken| RunError::new(broken.0, broken.1))
    }

    fn check(
        &self,
        run: &Simulation<'_, M, N, L>,
        start: &L::State,
        span: &Range<f64>,
    ) -> Result<(), RunErrorKind> {
        check_accuracy(self.accuracy)?;
        run.check_start(start)?;
        if run.nodes.is_some() {
            run.mesh(span)?;
        }
        if let Some(longest) = run.step {
            check_span(span, longest)?;
        }
        // Errors of the span, the breaks and the impulses.
        let h = (span.end - span.start) / 1000.0;
        let grid = Grid {
            step: Some(h),
            nodes: None,
            ..run.grid()
        };
        M::mesh(span, &grid)?;
        run.model.check_first((span.start, h), start)?;
        let mut stepper = M::stepper(run.model.clone(), run.chosen())?;
        M::check_velocity(&mut stepper, (span.start, start))
    }
}

impl<'m, M, const N: usize, L> Repeatable<N> for Simulation<'m, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    type Model = M;
    type State = L::State;
    type Stepper = L::Stepper<'m, M>;
    type Motion = Motion<N, L>;

    const MAY_VARY: bool = Steps::may_vary(M::FACTS, M::MAY_BE_OF_FIRST_ORDER);

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
        self.model.coordinates()
    }

    fn columns(&self) -> usize {
        self.model.output_count()
    }

    fn outputs(&self) -> Vec<String> {
        let names = self.model.output_names();
        names.iter().map(ToString::to_string).collect()
    }

    fn stepper(
        &self,
        element: Element,
        control: Control,
        is_recorded: bool,
    ) -> Result<L::Stepper<'m, M>, RunErrorKind> {
        let chosen = Chosen {
            element,
            control: trusting(control),
            ..self.chosen()
        };
        let stepper = M::stepper(self.model.clone(), chosen)?;
        Ok(
            if self.has_events() || (is_recorded && self.record_every == 1) {
                stepper
            } else {
                M::ends_only(stepper)
            },
        )
    }

    fn advance(
        &self,
        stepper: &mut L::Stepper<'m, M>,
        (t, next, h): (f64, f64, f64),
        mesh: &Mesh<N>,
        state: &mut L::State,
    ) -> Result<(), StepError> {
        self.model.kick(&self.impulses, (t, h), state);
        let impulses = mesh.impulses_in(t, next, mesh.end() == Some(next));
        let element = (mesh.begin(t, h), h);
        // A panic is reported by the recorded run, which meets it first.
        let advanced = (self.model).guarded(|| M::advance(stepper, element, state, impulses));
        advanced.unwrap_or(Err(StepError::NonFinite))
    }

    fn failed(&self, element: usize, at: (f64, f64), source: StepError) -> RunErrorKind {
        self.model.failed(element, at, source)
    }

    fn leave(stepper: &Self::Stepper, trail: &mut Trail) {
        M::leave(stepper, trail);
    }

    fn foresee(stepper: &mut Self::Stepper, trail: &Trail, step: (f64, f64)) {
        M::foresee(stepper, trail, step);
    }

    fn set_tolerance(stepper: &mut Self::Stepper, tolerance: f64) {
        M::set_tolerance(stepper, tolerance);
    }

    fn statistics(stepper: &Self::Stepper) -> Statistics {
        *M::statistics(stepper)
    }

    fn take_statistics(stepper: &mut Self::Stepper) -> Statistics {
        M::take_statistics(stepper)
    }

    fn model(&self) -> &M {
        &self.model
    }

    fn row(&self, stepper: &mut Self::Stepper, at: &At<'_, M, L::State>, row: &mut [f64]) {
        let At {
            model, t, state, ..
        } = *at;
        let (q, p) = L::parts(state);
        let n = q.as_ref().len();
        row[..n].copy_from_slice(q.as_ref());
        row[n..2 * n].copy_from_slice(p.as_ref());
        if row.len() == 2 * n {
            return;
        }
        let still = L::zero(q);
        let velocity = match M::NEEDS_VELOCITY {
            true => M::node(stepper, model, (t, state), &still).v,
            false => still,
        };
        model.outputs(t, (q, p), &velocity, &mut row[2 * n..]);
    }

    fn record(
        &self,
        stepper: &mut Self::Stepper,
        mesh: &Mesh<N>,
        (t, start): (f64, &L::State),
        passed: &mut Passing<'_, M, Self::Stepper, L::State>,
    ) -> Result<Motion<N, L>, Broken<Motion<N, L>>> {
        let mut compared = Compared {
            passed,
            model: self.model.clone(),
            acts: 0,
            last: t,
            goes_on: ControlFlow::Continue(()),
        };
        let mut motion = self
            .drive_over((t, start), mesh, stepper, Some(&mut compared))
            .map_err(|error| Box::new((error.kind().clone(), error.into_partial())))?;
        if self.crosses_kinks() {
            motion.add_warning(Warning::KinksCrossed);
        }
        // After an event has stopped the run, its state and parameters are kept to the end of the span.
        let Compared {
            model,
            acts,
            last,
            goes_on,
            ..
        } = compared;
        if goes_on.is_break() {
            return Ok(motion);
        }
        let ahead = mesh.ends_behind(last, t);
        if ahead.is_empty() {
            return Ok(motion);
        }
        let is_changed = !motion.settings().is_empty();
        let exchanged = |stepper: &mut Self::Stepper, model: &Share<'m, M>| match is_changed {
            true => M::exchange(stepper, model.clone()),
            false => Ok(()),
        };
        if let Err(kind) = exchanged(stepper, &model) {
            return Err(Box::new((kind, motion)));
        }
        let state = motion.last().state();
        for t in ahead {
            let at = At {
                model: &*model,
                t,
                state: &state,
                acts,
            };
            let _ = passed(stepper, &at);
        }
        match exchanged(stepper, &self.model) {
            Ok(()) => Ok(motion),
            Err(kind) => Err(Box::new((kind, motion))),
        }
    }

    fn crosses_kinks(&self) -> bool {
        self.at_kinks != Some(true) && !M::FACTS.smooth
    }

    fn has_events(&self) -> bool {
        !self.events.is_empty()
    }

    fn part(&self, (t0, start): (f64, &L::State), (t, end): (f64, &L::State)) -> Motion<N, L> {
        let part = self.model.guarded(|| {
            let stepper = M::stepper(self.model.clone(), self.chosen());
            let Ok(mut stepper) = stepper else {
                return self.model.first_node((t0, start), None);
            };
            let mut motion = self.model.first_node((t0, start), Some(&mut stepper));
            if t != t0 {
                M::record(&mut motion, &mut stepper, &self.model, (t, end));
            }
            motion
        });
        part.unwrap_or_else(|| Motion::unknown(&*self.model, t0, start))
    }

    fn even(&self, cuts: &[f64], step: f64) -> Result<Mesh<N>, RunErrorKind> {
        Mesh::even(cuts, step, &self.breaks, M::inner(&self.impulses))
    }

    fn through(&self, nodes: &[f64]) -> Result<Mesh<N>, RunErrorKind> {
        Mesh::of_nodes(nodes, &self.breaks, M::inner(&self.impulses))
    }

    fn nodes(&self) -> Option<&[f64]> {
        self.nodes.as_deref()
    }
}

/// The times of the breaks and of the impulses.
fn with_times<K>(breaks: &[f64], impulses: &[K], time: fn(&K) -> f64) -> Vec<f64> {
    let times = impulses.iter().map(time);
    breaks.iter().copied().chain(times).collect()
}

/// The follower that reports the end of each element to a comparison of runs.
struct Compared<'a, 'p, 'm, M, T, S> {
    passed: &'a mut Passing<'p, M, T, S>,
    /// The model with the parameters set by events so far.
    model: Share<'m, M>,
    /// The number of events that have cut an element so far.
    acts: usize,
    last: f64,
    goes_on: ControlFlow<()>,
}

impl<'m, M, const N: usize, L> Follow<'m, M, N, L>
    for Compared<'_, '_, 'm, M, L::Stepper<'m, M>, L::State>
where
    M: 'm,
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
        let at = At {
            model: &*self.model,
            t,
            state,
            acts: self.acts,
        };
        self.goes_on = (self.passed)(stepper, &at);
        self.goes_on
    }
}
