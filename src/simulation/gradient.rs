//! Gradients of losses, backwards along a run (T-127).

mod family;
mod view;

use super::follow::Nobody;
use super::sensitive::directions;
use super::setup::Simulation;
use super::trail::is_same;
use crate::error::{RunError, RunErrorKind};
use crate::length::FixedLength;
use crate::motion::Motion;
use crate::sensitivity::Sensitive;
use crate::sensitivity::loss::{Loss, LossGradient, Seen};
use std::convert::identity;
use std::ops::Range;
use tfe_runtime::step::Stepper;
use tfe_runtime::{Direction, Model, Parameter, Pull, State};
use view::{Unseen, View};

/// A gradient: by the start, ordered (p, q), and by all parameters.
struct Sums {
    by_start: Vec<f64>,
    by_parameters: Vec<f64>,
}

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    /// Runs over the span as [`run`](Self::run) does, and gives a loss of the motion with its gradient by all parameters of the model and by the start.
    ///
    /// The gradient is that of the numbers of the run, found in one pass backwards, in which every element is solved once more from its recorded start. What its interior has of the loss is found by an
    /// iteration as the element's own, where that contracts and the element is a Runge–Kutta method of a Lagrangian, else with the transposed factors of its tangent; all parameters together take one evaluation of the kernels
    /// at each point, with numbers that write down their operations. A chain of twelve masses with 36 parameters takes 4.2 times as long as a run, a net of 32 masses with 1025 parameters 8.1 times. With
    /// constraints it takes as much as [`run_sensitive`](Self::run_sensitive).
    /// Runs with [events](Self::on), and those with steps so long that an element does not end where it did when it is solved once more,
    /// are differentiated forwards.
    ///
    /// ```
    /// use tfe::prelude::*;
    /// use tfe::sensitivity::Loss;
    ///
    /// #[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - m*g*y, output(height) = y)]
    /// struct Ball { m: f64, g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Ball { m: 1.0, g: 9.81 };
    /// let loss = Loss::at_end(|node| 0.5 * node.q[0] * node.q[0]);
    /// let (loss, gradient) = Simulation::new(&ball).step(0.1).gradient(ball.state([1.0], [4.0]), 0.0..1.0, &loss)?;
    /// let height = 1.0 + 4.0 - 9.81 / 2.0;
    /// assert!((loss - 0.5 * height * height).abs() < 1e-13);
    /// assert!((gradient.by("g") + 0.5 * height).abs() < 1e-12);
    /// assert!((gradient.by_start().p[0] - height).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`RunError`], as from [`run`](Self::run); [`RunErrorKind::NoOutput`] and [`RunErrorKind::Loss`] for a loss that does not belong to the model and the span,
    /// [`RunErrorKind::Transition`] where an element has no derivative.
    pub fn gradient(
        &self,
        start: State<N>,
        span: Range<f64>,
        loss: &Loss<'_, N>,
    ) -> Result<(f64, LossGradient<N>), RunError<N>> {
        let outputs = (0..self.model.columns()).map(|at| self.model.column_name(at));
        let outputs: Vec<_> = outputs.collect();
        if let Err(kind) = loss.check(&outputs, (span.start, span.end)) {
            let motion = Motion::from_start(&*self.model, span.start, &start);
            return Err(RunError::new(kind, motion));
        }
        let mut run = self.clone().record_every(1);
        run.breaks.extend(loss.nodes());
        if !run.events.is_empty() {
            return run.forwards(start, span, loss);
        }
        let motion = run.drive(start, &span, identity, Nobody)?;
        run.backwards(motion, &span, loss)
    }

    fn backwards(
        &self,
        motion: Motion<N>,
        span: &Range<f64>,
        loss: &Loss<'_, N>,
    ) -> Result<(f64, LossGradient<N>), RunError<N>> {
        let model = &*self.model;
        let (value, seen) = match loss.seen(&motion, model) {
            Ok(seen) => seen,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        match self.pulled(&motion, span, &seen) {
            Ok(Some(gradient)) => Ok((value, self.gathered(motion, gradient))),
            // A long step that was cut, or not, where it now is not, or is.
            Ok(None) => {
                let start = motion.states()[0].state();
                self.forwards(start, span.clone(), loss)
            }
            Err(kind) => Err(RunError::new(kind, motion)),
        }
    }

    /// The gradient; `None` where an element does not end where it did.
    fn pulled(
        &self,
        motion: &Motion<N>,
        span: &Range<f64>,
        seen: &Seen,
    ) -> Result<Option<Sums>, RunErrorKind> {
        let mesh = self.mesh(span)?;
        let stepper = Stepper::sharing(self.model.clone(), self.chosen_element(), self.control);
        let mut stepper = stepper.map_err(RunErrorKind::Element)?;
        let parameters = self.all_parameters();
        let mut view = View::new(&*self.model, seen, &motion.last().v);
        let mut pull = Pull::new(&*self.model);
        let mut lambda = vec![0.0; 2 * N];
        let mut by_parameters = vec![0.0; parameters.len()];
        let all: Vec<_> = mesh.elements().collect();
        for (element, &(t, next, h)) in all.iter().enumerate().rev() {
            look(&view, &mut pull, (motion, element + 1), &mut lambda)?;
            let mut state = motion.states()[element].state();
            let impulses = mesh.impulses_in(t, next, element + 1 == all.len());
            let step = stepper.advance(mesh.begin(t, h), h, &mut state, impulses);
            step.map_err(|source| RunErrorKind::Solve {
                element,
                time: t,
                step: h,
                source,
            })?;
            let inside = view.of_element(&mut pull, &motion.elements()[element])?;
            let pieces = stepper.dense(t, next).pieces().len();
            let is_cut_alike = inside.is_empty() || inside.len() == pieces;
            let after = motion.states()[element + 1].state();
            if !(is_same::<N, FixedLength>(&state, &after) && is_cut_alike) {
                return Ok(None);
            }
            let adjoint =
                stepper.adjoint_inside(&parameters, &inside, &mut lambda, &mut by_parameters);
            adjoint.map_err(|source| RunErrorKind::Transition {
                element,
                time: t,
                step: h,
                source,
            })?;
        }
        look(&view, &mut pull, (motion, 0), &mut lambda)?;
        add_explicit(&pull, &mut by_parameters);
        Ok(Some(Sums {
            by_start: lambda,
            by_parameters,
        }))
    }

    /// All parameters as directions, to be taken at once where that can be.
    fn all_parameters(&self) -> Vec<Direction> {
        let indices: Vec<usize> = (0..self.model.parameters()).collect();
        let mut parameters = directions(&*self.model, &indices);
        if M::CONSTRAINTS.is_empty() {
            // By one kernel, which goes by numbers.
            for (index, direction) in parameters.iter_mut().enumerate() {
                direction.parameter = Some(Parameter::Any(index));
            }
        }
        parameters
    }

    /// The same forwards.
    fn forwards(
        &self,
        start: State<N>,
        span: Range<f64>,
        loss: &Loss<'_, N>,
    ) -> Result<(f64, LossGradient<N>), RunError<N>> {
        let sensitive = match loss.has_integrals() {
            true => self.run_sensitive(start, span)?,
            false => self.run_sensitive_at_nodes(start, span)?,
        };
        let motion = sensitive.motion().clone();
        let found = loss.seen(&motion, &*self.model);
        let summed = found.and_then(|(value, seen)| Ok((value, self.summed(&sensitive, &seen)?)));
        match summed {
            Ok((value, gradient)) => Ok((value, self.gathered(motion, gradient))),
            Err(kind) => Err(RunError::new(kind, motion)),
        }
    }

    /// What a loss has of nodes and of elements, times their derivatives.
    fn summed(&self, sensitive: &Sensitive<N>, seen: &Seen) -> Result<Sums, RunErrorKind> {
        let motion = sensitive.motion();
        let mut view = View::new(&*self.model, seen, &motion.last().v);
        let mut pull = Pull::new(&*self.model);
        let mut all = vec![0.0; 2 * N + self.model.parameters()];
        for number in 0..motion.states().len() {
            let mut lambda = vec![0.0; 2 * N];
            look(&view, &mut pull, (motion, number), &mut lambda)?;
            if lambda.iter().any(|one| *one != 0.0) {
                let slopes = sensitive.state_slopes(number);
                for (column, sum) in all.iter_mut().enumerate() {
                    let through = (0..2 * N).map(|row| lambda[row] * slopes[(row, column)]);
                    *sum += through.sum::<f64>();
                }
            }
        }
        view.add_along(&mut pull, sensitive, &mut all)?;
        let mut by_parameters = all.split_off(2 * N);
        add_explicit(&pull, &mut by_parameters);
        Ok(Sums {
            by_start: all,
            by_parameters,
        })
    }

    fn gathered(&self, motion: Motion<N>, sums: Sums) -> LossGradient<N> {
        let names =
            (0..self.model.parameters()).map(|at| self.model.parameter_name(at).to_string());
        LossGradient::new(motion, names.collect(), sums.by_parameters, &sums.by_start)
    }
}

/// Adds what a loss has directly of a node to λ, ordered (p, q), and to the sums of parameters.
fn look<M: Model<N>, const N: usize>(
    view: &View<'_, M, N>,
    pull: &mut Pull<'_, M, N>,
    (motion, number): (&Motion<N>, usize),
    lambda: &mut [f64],
) -> Result<(), RunErrorKind> {
    let Some(partials) = view.of_node(number) else {
        return Ok(());
    };
    let node = &motion.states()[number];
    let by_state = pull.see(node.t, (&node.state(), &node.v), &partials);
    let by_state = by_state.map_err(|_| Unseen)?;
    for (sum, own) in lambda.iter_mut().zip(by_state.p.iter().chain(&by_state.q)) {
        *sum += own;
    }
    Ok(())
}

/// Adds what was seen of parameters directly.
fn add_explicit<M: Model<N>, const N: usize>(pull: &Pull<'_, M, N>, by_parameters: &mut [f64]) {
    for (index, sum) in by_parameters.iter_mut().enumerate() {
        *sum += pull.by_parameter(index);
    }
}
