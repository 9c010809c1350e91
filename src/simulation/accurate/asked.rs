//! The calls for runs with error estimates and for runs with a prescribed accuracy.

use super::super::kind::Simulated;
use super::super::mesh::{Grid, Mesh};
use super::super::setup::Simulation;
use super::super::times::check_span;
use super::graded::Steps;
use super::runs::Kept;
use super::trial::{Trial, shown};
use super::{Accurate, accurate, check_accuracy, estimated};
use crate::accuracy::{Asked, Estimated};
use crate::error::{RunError, RunErrorKind};
use crate::length::Length;
use crate::motion::Motion;
use std::ops::Range;
use tfe_runtime::Solve;

impl<M, const N: usize, L> Simulation<'_, M, N, L>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    /// Asks for an accuracy: the run then chooses the element and the step size such that the estimated error is at
    /// most `accuracy`, a number between 0 and 1.
    ///
    /// The error is relative, and estimated at the times at which the runs are compared: the error of the coordinates
    /// divided by the largest coordinate, of the momenta divided by the largest momentum, and of each declared output
    /// divided by its largest value. The motion carries its estimate, and [`Estimated::picked`] says what was chosen
    /// and why.
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
    pub fn accuracy(mut self, accuracy: f64) -> Accurate<Self> {
        self.at_kinks.get_or_insert(true);
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
            let mesh = match self.prepare(&start, &span) {
                Ok((mesh, _)) => mesh,
                Err(kind) => return Err(self.refused(kind, at_start)),
            };
            let trial = Trial::new(self, at_start, &span);
            trial.told(estimated(&trial, mesh.times()), None)
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
    /// [`RunError`], as from [`Simulation::run`]. [`RunErrorKind::Accuracy`] unless the accuracy is between 0 and 1;
    /// [`RunErrorKind::TooManySteps`] if it would take more than ten million steps;
    /// [`RunErrorKind::AccuracyMissed`] if no step size was found that
    /// meets the accuracy, for example because the motion is chaotic and the span too long, or the accuracy is below
    /// the effect of rounding; the best motion is in [`partial`](RunError::partial).
    pub fn run(
        &self,
        start: L::State,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<N, L>>, RunError<N, L>> {
        let run = &self.simulation;
        let at_start = (span.start, &start);
        if span.start == span.end {
            if let Err(kind) = check_accuracy(self.accuracy) {
                return Err(run.refused(kind, at_start));
            }
            let motion = run.run(start, span)?;
            let outputs = shown(&run.model.output_names());
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
        if let Err(kind) = self.check(run, start, span) {
            return Err(run.refused(kind, at_start));
        }
        let asked = Asked {
            outputs: shown(&run.model.output_names()),
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
        let trial = Trial::new(run, at_start, span);
        let mut kept = Kept::NOTHING;
        let found = accurate(&trial, &asked, steps, &mut kept);
        trial.told(found, kept.farthest)
    }

    fn check(
        &self,
        run: &Simulation<'_, M, N, L>,
        start: &L::State,
        span: &Range<f64>,
    ) -> Result<(), RunErrorKind> {
        check_accuracy(self.accuracy)?;
        run.check_start(start)?;
        check_grid(span, run.grid(), M::mesh)?;
        let first = (span.start, trial_step(span));
        run.model.check_first(first, start)?;
        match M::stepper(run.model.clone(), run.chosen()) {
            Ok(mut stepper) => M::check_velocity(&mut stepper, (span.start, start)),
            Err(kind) => Err(kind),
        }
    }
}

/// A step with which a span is checked before there is another one.
fn trial_step(span: &Range<f64>) -> f64 {
    (span.end - span.start) / 1000.0
}

/// Refuses nodes and longest steps that do not fit the span, and breaks and impulses.
fn check_grid<I, const N: usize>(
    span: &Range<f64>,
    grid: Grid<'_, I>,
    mesh: fn(&Range<f64>, &Grid<'_, I>) -> Result<Mesh<N>, RunErrorKind>,
) -> Result<(), RunErrorKind> {
    if grid.nodes.is_some() {
        mesh(span, &grid)?;
    }
    if let Some(longest) = grid.step {
        check_span(span, longest)?;
    }
    let trial = Grid {
        step: Some(trial_step(span)),
        nodes: None,
        ..grid
    };
    mesh(span, &trial).map(|_| ())
}

/// The times of the breaks and of the impulses.
fn with_times<K>(breaks: &[f64], impulses: &[K], time: fn(&K) -> f64) -> Vec<f64> {
    let times = impulses.iter().map(time);
    breaks.iter().copied().chain(times).collect()
}
