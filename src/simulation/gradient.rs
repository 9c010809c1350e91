//! Gradients of losses by the adjoint method, backward along a run (T-127).

#[cfg(feature = "sparse")]
mod backward;
mod family;
mod view;

use super::kind::Simulated;
use super::mesh::Mesh;
use super::setup::Simulation;
use super::trail::is_same;
use crate::error::{RunError, RunErrorKind};
use crate::length::FixedLength;
use crate::motion::{Motion, Node};
use crate::sensitivity::Sensitive;
use crate::sensitivity::loss::{Loss, LossGradient, Seen};
use crate::sensitivity::slopes::directions;
use std::convert::identity;
use std::ops::Range;
use tfe_runtime::step::Stepper;
use tfe_runtime::{Direction, Model, Parameter, Pull, State};
use view::{Unseen, View};

/// A gradient by the start, in the order (p, q), and by all parameters.
struct Sums {
    by_start: Vec<f64>,
    by_parameters: Vec<f64>,
}

impl<'m, M: Model<N>, const N: usize> Simulation<'m, M, N> {
    /// Runs over the span as [`run`](Self::run) does, and returns a loss of the motion with its gradient with respect
    /// to all parameters of the model and to the start (adjoint method, T-127).
    ///
    /// The gradient is the derivative of the computed motion, exact up to rounding. It is found in one pass backwards
    /// over the elements, each of which is solved once more from its recorded start. The adjoint equations of an
    /// element are solved by an iteration like the element's own, if that converges quickly and the element is a
    /// Runge–Kutta method of a Lagrangian, otherwise with the transposed factors of its tangent. All parameters
    /// together take one evaluation of the kernels at each point, by reverse differentiation.
    ///
    /// Measured cost: 4.2 runs for a chain of twelve masses with 36 parameters, 8.1 runs for a net of 32 masses with
    /// 1025 parameters. With constraints the cost is that of [`run_sensitive`](Self::run_sensitive). Runs with
    /// [events](Self::on), and runs with steps so long that an element does not end at the same state when it is
    /// solved again, are differentiated forwards.
    ///
    /// All nodes and elements of the run are in memory, unless [`record_every`](Self::record_every) keeps only every
    /// k-th node: the motion between two of these is then computed again on the way back. About k + n/k of n nodes are
    /// in memory at a time, fewest for k = √n, for the time of one more run.
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
    /// [`RunError`], as from [`run`](Self::run). [`RunErrorKind::NoOutput`] or [`RunErrorKind::Loss`] if the loss does
    /// not fit the model or the span, [`RunErrorKind::Transition`] if an element or an event has no derivative,
    /// and [`RunErrorKind::SetUnsupported`] if an event [sets](crate::Act::Set) a parameter.
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
        let mut run = self.cut_at_kinks();
        run.look_at(loss, &span);
        if !run.events.is_empty() {
            return run.record_every(1).forwards(start, span, loss);
        }
        let mut motion = run.drive(start, &span, identity, None)?;
        run.warn_of_kinks(&mut motion);
        match run.descended(&motion, &span, loss) {
            Ok(Some((value, sums))) => Ok((value, run.gathered(motion, sums)?)),
            // A step that was too long was cut in one pass and not in the other.
            Ok(None) => run.record_every(1).forwards(start, span, loss),
            Err(kind) => Err(RunError::new(kind, motion)),
        }
    }

    /// The loss and its gradient, by a backward pass between recorded nodes; `None` if a repeated element does not end
    /// where it did in the run.
    fn descended(
        &self,
        motion: &Motion<N>,
        span: &Range<f64>,
        loss: &Loss<'_, N>,
    ) -> Result<Option<(f64, Sums)>, RunErrorKind> {
        let mesh = self.mesh(span)?;
        let elements: Vec<_> = mesh.elements().collect();
        let mut descent = Descent::new(self, (&mesh, &elements))?;
        if self.record_every == 1 || elements.is_empty() {
            let (value, seen) = loss.seen(motion, &*self.model)?;
            let whole = descent.pass(motion, 0, &seen)?;
            return Ok(whole.then(|| (value, descent.into_sums())));
        }
        let mut sum = 0.0;
        let segments = elements.len().div_ceil(self.record_every);
        for segment in (0..segments).rev() {
            let first = segment * self.record_every;
            let [before, after] = [segment, segment + 1].map(|node| &motion.states()[node]);
            let part = loss.part((before.t, after.t), (segment == 0, segment + 1 == segments));
            let Some(again) = descent.repeat(before, first, after)? else {
                return Ok(None);
            };
            let (value, seen) = part.seen(&again, &*self.model)?;
            sum += value;
            if !descent.pass(&again, first, &seen)? {
                return Ok(None);
            }
        }
        Ok(Some((sum, descent.into_sums())))
    }

    /// The directions of all parameters, grouped into one kernel where possible.
    fn all_parameters(&self) -> Vec<Direction> {
        let indices: Vec<usize> = (0..self.model.parameters()).collect();
        let mut parameters = directions(&*self.model, &indices);
        if M::CONSTRAINTS.is_empty() {
            // One kernel takes all parameters by their indices.
            for (index, direction) in parameters.iter_mut().enumerate() {
                direction.parameter = Some(Parameter::Any(index));
            }
        }
        parameters
    }

    /// The same by forward sensitivities.
    fn forwards(
        &self,
        start: State<N>,
        span: Range<f64>,
        loss: &Loss<'_, N>,
    ) -> Result<(f64, LossGradient<N>), RunError<N>> {
        let sensitive = match loss.has_integrals() {
            true => self.run_sensitive(start, span),
            false => self.run_sensitive_at_nodes(start, span),
        };
        let sensitive = sensitive.map_err(|error| error.of_call("run_sensitive", "gradient"))?;
        let motion = sensitive.motion().clone();
        let found = loss.seen(&motion, &*self.model);
        let summed = found.and_then(|(value, seen)| Ok((value, self.summed(&sensitive, &seen)?)));
        match summed {
            Ok((value, gradient)) => Ok((value, self.gathered(motion, gradient)?)),
            Err(kind) => Err(RunError::new(kind, motion)),
        }
    }

    /// The gradient as the sum over nodes and elements of the derivatives of the loss times the sensitivities.
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
        if let Some(times) = sensitive.end_times() {
            let by_time = view.by_time(motion.states().len() - 1, motion.last());
            for (sum, moved) in all.iter_mut().zip(times) {
                *sum += by_time * moved;
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

    fn gathered(&self, motion: Motion<N>, sums: Sums) -> Result<LossGradient<N>, RunError<N>> {
        let names =
            (0..self.model.parameters()).map(|at| self.model.parameter_name(at).to_string());
        LossGradient::new(motion, names.collect(), sums.by_parameters, &sums.by_start)
    }
}

/// The state of a backward pass over the elements of a run.
struct Descent<'a, 'm, M, const N: usize> {
    model: &'a M,
    mesh: &'a Mesh<N>,
    /// The elements of the mesh: start, end and length.
    elements: &'a [(f64, f64, f64)],
    stepper: Stepper<'m, M, N>,
    parameters: Vec<Direction>,
    pull: Pull<'a, M, N>,
    lambda: Vec<f64>,
    by_parameters: Vec<f64>,
}

impl<'a, 'm, M: Model<N>, const N: usize> Descent<'a, 'm, M, N> {
    fn new(
        run: &'a Simulation<'m, M, N>,
        (mesh, elements): (&'a Mesh<N>, &'a [(f64, f64, f64)]),
    ) -> Result<Self, RunErrorKind> {
        let parameters = run.all_parameters();
        Ok(Self {
            model: &*run.model,
            mesh,
            elements,
            stepper: M::stepper(run.model.clone(), run.chosen())?,
            by_parameters: vec![0.0; parameters.len()],
            parameters,
            pull: Pull::new(&*run.model),
            lambda: vec![0.0; 2 * N],
        })
    }

    /// Solves an element from its start.
    fn solve(&mut self, element: usize, state: &mut State<N>) -> Result<(), RunErrorKind> {
        let (time, next, step) = self.elements[element];
        let is_last = element + 1 == self.elements.len();
        let impulses = self.mesh.impulses_in(time, next, is_last);
        let begin = self.mesh.begin(time, step);
        let solved = self.stepper.advance(begin, step, state, impulses);
        solved.map_err(|source| RunErrorKind::Solve {
            element,
            time,
            step,
            source,
        })
    }

    /// Repeats the run between two recorded nodes, with all nodes; `None` if it ends elsewhere.
    fn repeat(
        &mut self,
        before: &Node<N>,
        first: usize,
        after: &Node<N>,
    ) -> Result<Option<Motion<N>>, RunErrorKind> {
        let mut state = before.state();
        let mut motion = Motion::from_start(self.model, before.t, &state);
        let mut element = first;
        while motion.last().t != after.t && element < self.elements.len() {
            self.solve(element, &mut state)?;
            let (t, next, _) = self.elements[element];
            motion.keep_element(self.stepper.dense(t, next));
            motion.record(self.model, next, &state);
            element += 1;
        }
        let ends = (&before.state(), &after.state());
        let place = (before.t, after.t - before.t);
        let is_same = is_same::<M, N, FixedLength>(self.model, place, &state, ends, 0.0);
        Ok(is_same.then_some(motion))
    }

    /// Passes backward over a motion whose first element has the index `first`; false if an element does not end where
    /// it did.
    fn pass(
        &mut self,
        motion: &Motion<N>,
        first: usize,
        seen: &Seen,
    ) -> Result<bool, RunErrorKind> {
        let mut view = View::new(self.model, seen, &motion.last().v);
        for (number, inner) in motion.elements().iter().enumerate().rev() {
            look(
                &view,
                &mut self.pull,
                (motion, number + 1),
                &mut self.lambda,
            )?;
            let (element, before) = (first + number, motion.states()[number].state());
            let mut state = before;
            self.solve(element, &mut state)?;
            let mut inside = view.of_element(&mut self.pull, inner)?;
            if inside.len() > 1 {
                for (loss, piece) in inside.iter_mut().zip(inner.pieces()) {
                    loss.ends = view.by_ends(piece)?;
                }
            }
            let (time, next, step) = self.elements[element];
            let pieces = self.stepper.dense(time, next).pieces().len();
            let is_cut_alike = inside.is_empty() || inside.len() == pieces;
            let after = motion.states()[number + 1].state();
            // If iterations stop at a tolerance, forward sensitivities are those of what was computed.
            let (place, ends) = ((time, step), (&before, &after));
            let is_same = is_same::<M, N, FixedLength>(self.model, place, &state, ends, 0.0);
            if !(is_same && is_cut_alike) {
                return Ok(false);
            }
            let (lambda, by_parameters) = (&mut self.lambda, &mut self.by_parameters);
            let parameters = &self.parameters;
            let adjoint = (self.stepper).adjoint_inside(parameters, &inside, lambda, by_parameters);
            adjoint.map_err(|source| RunErrorKind::Transition {
                element,
                time,
                step,
                source,
            })?;
        }
        look(&view, &mut self.pull, (motion, 0), &mut self.lambda)?;
        Ok(true)
    }

    fn into_sums(mut self) -> Sums {
        add_explicit(&self.pull, &mut self.by_parameters);
        Sums {
            by_start: self.lambda,
            by_parameters: self.by_parameters,
        }
    }
}

/// Adds the direct derivatives of the loss at a node to λ, in the order (p, q), and to the sums of parameters.
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

/// Adds the collected explicit derivatives by parameters.
fn add_explicit<M: Model<N>, const N: usize>(pull: &Pull<'_, M, N>, by_parameters: &mut [f64]) {
    for (index, sum) in by_parameters.iter_mut().enumerate() {
        *sum += pull.by_parameter(index);
    }
}
