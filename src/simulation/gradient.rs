//! Gradients of losses, backwards along a run (T-127).

mod family;

use super::follow::Nobody;
use super::sensitive::directions;
use super::setup::Simulation;
use super::trail::is_same;
use crate::error::{RunError, RunErrorKind};
use crate::length::FixedLength;
use crate::motion::Motion;
use crate::sensitivity::Sensitive;
use crate::sensitivity::loss::{Look, Loss, LossGradient};
use crate::sensitivity::slopes::{Along, Change, Place};
use std::convert::identity;
use std::ops::Range;
use tfe_runtime::step::Stepper;
use tfe_runtime::{Model, Parameter, State};

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
        run.breaks.extend(loss.times());
        if !run.events.is_empty() {
            let sensitive = run.run_sensitive(start, span)?;
            return run.forwards(&sensitive, loss);
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
        let (value, looks) = match loss.looks(&motion) {
            Ok(looks) => looks,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let indices: Vec<usize> = (0..model.parameters()).collect();
        let mut parameters = directions(model, &indices);
        if M::CONSTRAINTS.is_empty() {
            // All at once by one kernel, which goes by numbers.
            for (index, direction) in parameters.iter_mut().enumerate() {
                direction.parameter = Some(Parameter::Any(index));
            }
        }
        let mut lambda = vec![0.0; 2 * N];
        let mut by_parameters = vec![0.0; indices.len()];
        let elements = self.mesh(span).and_then(|mesh| {
            let stepper = Stepper::sharing(self.model.clone(), self.chosen_element(), self.control);
            Ok((mesh, stepper.map_err(RunErrorKind::Element)?))
        });
        let (mesh, mut stepper) = match elements {
            Ok(elements) => elements,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let all: Vec<_> = mesh.elements().collect();
        for (element, &(t, next, h)) in all.iter().enumerate().rev() {
            self.look(
                &motion,
                &looks,
                element + 1,
                (&mut lambda, &mut by_parameters),
            );
            let mut state = motion.states()[element].state();
            let impulses = mesh.impulses_in(t, next, element + 1 == all.len());
            let step = stepper.advance(mesh.begin(t, h), h, &mut state, impulses);
            let step = step.map_err(|source| RunErrorKind::Solve {
                element,
                time: t,
                step: h,
                source,
            });
            if step.is_ok()
                && !is_same::<N, FixedLength>(&state, &motion.states()[element + 1].state())
            {
                // A long step that was cut, or not, where it now is not, or is.
                let start = motion.states()[0].state();
                let sensitive = self.run_sensitive(start, span.clone())?;
                return self.forwards(&sensitive, loss);
            }
            let differentiated = step.and_then(|()| {
                let adjoint = stepper.adjoint(&parameters, &mut lambda, &mut by_parameters);
                adjoint.map_err(|source| RunErrorKind::Transition {
                    element,
                    time: t,
                    step: h,
                    source,
                })
            });
            if let Err(kind) = differentiated {
                return Err(RunError::new(kind, motion));
            }
        }
        self.look(&motion, &looks, 0, (&mut lambda, &mut by_parameters));
        Ok((value, self.gathered(motion, &lambda, by_parameters)))
    }

    /// Adds what the loss has directly of a node.
    fn look(
        &self,
        motion: &Motion<N>,
        looks: &[Look],
        number: usize,
        (lambda, by_parameters): (&mut [f64], &mut [f64]),
    ) {
        let mut looks = looks.iter().filter(|look| look.node == number).peekable();
        if looks.peek().is_none() {
            return;
        }
        let node = motion.states()[number];
        let state = node.state();
        let place = Place {
            t: node.t,
            state: &state,
            v: &node.v,
        };
        let along = Along::new(&*self.model, place);
        for look in looks {
            for (row, lambda) in lambda.iter_mut().enumerate() {
                let mut change = Change::ZERO;
                match row.checked_sub(N) {
                    None => change.p[row] = 1.0,
                    Some(row) => change.q[row] = 1.0,
                }
                *lambda += look.slope(&along, &change);
            }
            for (index, sum) in by_parameters.iter_mut().enumerate() {
                let change = Change {
                    parameter: Some(index),
                    ..Change::ZERO
                };
                *sum += look.slope(&along, &change);
            }
        }
    }

    fn forwards(
        &self,
        sensitive: &Sensitive<N>,
        loss: &Loss<'_, N>,
    ) -> Result<(f64, LossGradient<N>), RunError<N>> {
        let motion = sensitive.motion().clone();
        let (value, looks) = match loss.looks(&motion) {
            Ok(looks) => looks,
            Err(kind) => return Err(RunError::new(kind, motion)),
        };
        let count = self.model.parameters();
        let mut all = vec![0.0; 2 * N + count];
        for number in 0..motion.states().len() {
            let (mut lambda, mut direct) = (vec![0.0; 2 * N], vec![0.0; count]);
            self.look(&motion, &looks, number, (&mut lambda, &mut direct));
            if lambda.iter().chain(&direct).all(|one| *one == 0.0) {
                continue;
            }
            let slopes = sensitive.state_slopes(number);
            for (column, sum) in all.iter_mut().enumerate() {
                let through: f64 = (0..2 * N)
                    .map(|row| lambda[row] * slopes[(row, column)])
                    .sum();
                *sum += through + column.checked_sub(2 * N).map_or(0.0, |index| direct[index]);
            }
        }
        let by_parameters = all.split_off(2 * N);
        Ok((value, self.gathered(motion, &all, by_parameters)))
    }

    /// The gradient by parameters and by the start, ordered (p, q).
    fn gathered(
        &self,
        motion: Motion<N>,
        lambda: &[f64],
        by_parameters: Vec<f64>,
    ) -> LossGradient<N> {
        let names =
            (0..self.model.parameters()).map(|at| self.model.parameter_name(at).to_string());
        LossGradient::new(motion, names.collect(), by_parameters, lambda)
    }
}
