//! Runs of models of run-time length with an estimate of their error.

use super::graded::Steps;
use super::repeatable::{Broken, Passing, Repeatable, trusting};
use super::{Accurate, accurate, check_accuracy, estimated};
use crate::accuracy::{Asked, Estimated};
use crate::error::{RunError, RunErrorKind};
use crate::length::RunTimeLength;
use crate::motion::{Motion, Node, Warning};
use crate::simulation::Simulation;
use crate::simulation::family::node;
use crate::simulation::mesh::Mesh;
use std::ops::Range;
use tfe_runtime::family::{FamilyModel, FamilyState, FamilyStepper};
use tfe_runtime::step::Control;
use tfe_runtime::{Element, Form, Solve, Statistics, StepError};

impl<M: FamilyModel> Simulation<'_, M, 0, RunTimeLength> {
    /// Picks element and step so that the estimated error is at or below `accuracy`, as [`Simulation::accuracy`](crate::Simulation::accuracy) does: largest errors over
    /// all sites, each over the largest number of its kind.
    ///
    /// Where forces have kinks or jumps, steps would go across them, and no estimate would be certain: that is refused, [`RunErrorKind::KinksUnsupported`].
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(
    ///     coordinates(q[n]),
    ///     lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + a/3*(q[i+1]-q[i])^3),
    /// )]
    /// struct Chain { n: usize, a: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let chain = Chain { n: 100, a: 0.25 };
    /// let q: Vec<f64> = (0..chain.n).map(|i| (0.1 * i as f64).cos()).collect();
    /// let start = chain.state(q, vec![0.0; chain.n]);
    /// let motion = Simulation::new(&chain).accuracy(1e-8).run(start, 0.0..20.0)?;
    /// assert!(motion.error_estimate() <= 1e-8);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn accuracy(self, accuracy: f64) -> Accurate<Self> {
        Accurate::new(self, accuracy)
    }

    /// Runs over the span as [`run`](Self::run) does, and estimates the error at every node by a second run with an element of higher order (T-98), as
    /// [`Simulation::run_estimated`](crate::Simulation::run_estimated) does. Where forces have kinks or jumps steps go across them, and the motion says so, [`Warning::KinksCrossed`].
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run), of either run.
    pub fn run_estimated(
        &self,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<0, RunTimeLength>>, RunError<0, RunTimeLength>> {
        let refused = |kind| self.refused(kind, span.start, &start);
        self.without_impulses("run_estimated").map_err(refused)?;
        self.stepper(span.start, &start).map_err(refused)?;
        let mesh = self.mesh(&span).map_err(refused)?;
        estimated(self, (span.start, &start), &mesh)
            .map_err(|broken| RunError::new(broken.0, broken.1))
    }
}

impl<M: FamilyModel> Accurate<Simulation<'_, M, 0, RunTimeLength>> {
    /// Runs over the span with the element and the step that meet the accuracy.
    ///
    /// # Errors
    /// [`RunError`], as from [`Simulation::run`]; [`RunErrorKind::AccuracyMissed`] where no step was found that meets the accuracy, with the best motion
    /// in [`partial`](RunError::partial).
    pub fn run(
        &self,
        start: FamilyState,
        span: Range<f64>,
    ) -> Result<Estimated<Motion<0, RunTimeLength>>, RunError<0, RunTimeLength>> {
        let run = &self.simulation;
        let refused = |kind| run.refused(kind, span.start, &start);
        check_accuracy(self.accuracy).map_err(refused)?;
        if run.crosses_kinks() {
            let call = "accuracy";
            return Err(refused(RunErrorKind::KinksUnsupported { call }));
        }
        run.without_impulses("accuracy").map_err(refused)?;
        run.stepper(span.start, &start).map_err(refused)?;
        run.mesh(&span).map_err(refused)?;
        if span.start == span.end {
            let motion = run.run(start.clone(), span.clone())?;
            let outputs = run.outputs();
            return Ok(Estimated::new(
                motion,
                Vec::new(),
                Vec::new(),
                outputs,
                None,
            ));
        }
        let asked = Asked {
            accuracy: self.accuracy,
            span: span.clone(),
            breaks: run.breaks.clone(),
            element: run.element,
            longest: run.step,
            // Without sparse factorisations there is nothing else.
            may_iterate: run.control.solve == Solve::Auto
                && const { M::FACTS.separable && !M::CONSTRAINED },
            solve: run.control.solve,
            graded: None,
            in_pairs: M::CONSTRAINED,
        };
        let steps = Steps::of(&M::FACTS, self.equal_steps, M::CONSTRAINED);
        accurate(run, &start, &asked, steps).map_err(|broken| RunError::new(broken.0, broken.1))
    }
}

impl<'m, M: FamilyModel> Repeatable<0> for Simulation<'m, M, 0, RunTimeLength> {
    type State = FamilyState;
    type Stepper = FamilyStepper<'m, M>;
    type Motion = Motion<0, RunTimeLength>;

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
        self.model.len()
    }

    fn columns(&self) -> usize {
        self.model.columns()
    }

    fn outputs(&self) -> Vec<String> {
        (0..self.columns())
            .map(|column| self.model.column_name(column).to_string())
            .collect()
    }

    fn stepper(
        &self,
        element: Element,
        control: Control,
        _: bool,
    ) -> Result<FamilyStepper<'m, M>, RunErrorKind> {
        FamilyStepper::new(self.model, element, trusting(control)).map_err(RunErrorKind::Family)
    }

    fn advance(
        &self,
        stepper: &mut FamilyStepper<'m, M>,
        (t, _, h): (f64, f64, f64),
        mesh: &Mesh<0>,
        state: &mut FamilyState,
    ) -> Result<(), StepError> {
        stepper.advance(mesh.begin(t, h), h, state)
    }

    fn set_tolerance(stepper: &mut FamilyStepper<'m, M>, tolerance: f64) {
        stepper.set_tolerance(tolerance);
    }

    fn statistics(stepper: &FamilyStepper<'m, M>) -> Statistics {
        *stepper.statistics()
    }

    fn take_statistics(stepper: &mut FamilyStepper<'m, M>) -> Statistics {
        stepper.take_statistics()
    }

    fn row(
        &self,
        stepper: &mut FamilyStepper<'m, M>,
        t: f64,
        state: &FamilyState,
        row: &mut [f64],
    ) {
        let n = state.q.len();
        row[..n].copy_from_slice(&state.q);
        row[n..2 * n].copy_from_slice(&state.p);
        if row.len() == 2 * n {
            return;
        }
        let velocity;
        let z = match M::FORM {
            Form::Hamiltonian => &state.p,
            Form::Lagrangian => {
                velocity = stepper
                    .velocity(t, state)
                    .unwrap_or_else(|_| vec![f64::NAN; n]);
                &velocity
            }
        };
        self.model.observables(t, &state.q, z, &mut row[2 * n..]);
    }

    fn record(
        &self,
        stepper: &mut FamilyStepper<'m, M>,
        mesh: &Mesh<0>,
        start: (f64, &FamilyState),
        passed: &mut Passing<'_, FamilyStepper<'m, M>, FamilyState>,
    ) -> Result<Motion<0, RunTimeLength>, Broken<Motion<0, RunTimeLength>>> {
        let mut motion = self.drive_over(start, mesh, stepper, passed)?;
        if self.crosses_kinks() {
            motion.add_warning(Warning::KinksCrossed);
        }
        Ok(motion)
    }

    fn crosses_kinks(&self) -> bool {
        const { !M::FACTS.smooth }
    }

    fn part(
        &self,
        (t0, start): (f64, &FamilyState),
        (t, end): (f64, &FamilyState),
    ) -> Motion<0, RunTimeLength> {
        let Ok((mut stepper, velocity)) = self.stepper(t0, start) else {
            return Motion::unasked(t0, start);
        };
        let mut motion = Motion::starting(self.model, Node::of(t0, start, velocity));
        if t != t0 {
            motion.record_node(self.model, node(&mut stepper, t, end));
        }
        motion
    }

    fn even(&self, cuts: &[f64], step: f64) -> Result<Mesh<0>, RunErrorKind> {
        Mesh::even(cuts, step, &self.breaks, &[])
    }

    fn through(&self, nodes: &[f64]) -> Result<Mesh<0>, RunErrorKind> {
        Mesh::of_nodes(nodes, &self.breaks, &[])
    }

    fn nodes(&self) -> Option<&[f64]> {
        self.nodes.as_deref()
    }
}
