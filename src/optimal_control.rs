//! Optimal control: the inputs of least cost over a time span, by direct transcription with the elements of the model.

mod block;
mod condensed;
mod correction;
mod curvature;
mod dependence;
mod error;
mod optimum;
mod problem;
mod resolved;
mod search;
mod transcription;

use crate::assembly::{Curve, Mesh};
use crate::boundary::{
    BoundaryError, Component, Condition, check_conditions, check_span, straight,
};
use crate::driven::place;
use crate::numbers::is_tolerance;
use block::Said;
use nalgebra::DVector;
use problem::{Ends, Iterate, Problem};
use search::{Control, Failure};
use std::ops::Range;
use std::sync::Arc;
use tfe_runtime::basis::{MAX_NODES, legendre};
use tfe_runtime::scheme::{SchemeTable, Tables};
use tfe_runtime::{Controlled, Element, Form, Mixed, State};
use transcription::Sizes;

pub use error::{OptimalControlError, OptimalControlErrorKind};
pub use optimum::{Costate, Optimum};
pub use search::Iteration;

/// An optimal-control problem: find the inputs u(t) of a model that minimise the cost
///
/// ```text
/// ∫ Σ running costs (t, q, v, u) dt + Σ end costs (t, q, v) → min
/// ```
///
/// subject to the equations of motion and to the values given at the start and at the end. Costs are outputs of the
/// model, so that their derivatives are as exact as those of the model.
///
/// Each input is a polynomial in each element. The states follow from the element, so that the solution is a motion of
/// the model with the order and the momentum maps that every run with this element has. The unknowns are the nodes,
/// the interiors and the inputs of all elements together, with multipliers (costates). They are found by sequential
/// quadratic programming with the second derivatives of the Lagrangian function of the problem: (T-144) to (T-148) in
/// `docs/theory.md`. The work of an iteration is linear in the number of elements.
///
/// Defaults: element `Mixed::<4>` (order 6 for states, integrals of inputs, and multipliers), 40 equal elements,
/// inputs with as many coefficients in an element as it has rates; the first guess is straight lines between the
/// coordinates given, with zero inputs.
///
/// The minimum found is a local one; which one depends on the guess. If the search reaches a stationary point that is
/// not a minimum, it continues along a direction of negative curvature, in which the cost falls to second order,
/// (T-163); if that leads to no minimum, the result is [`OptimalControlErrorKind::NoMinimum`].
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(
///     coordinates(x), lagrangian = dot(x)^2/2,
///     input(u), force(x) = u, output(effort) = u^2,
/// )]
/// struct Sled;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // From rest to rest over a unit of length in a unit of time: u = 6 − 12 t, ∫ u² dt = 12.
/// let best = OptimalControl::of(&Sled)
///     .elements(4)
///     .from_to(Sled.state([0.0], [0.0]), Sled.state([1.0], [0.0]), 0.0..1.0)
///     .running_cost("effort")
///     .solve()?;
/// assert!((best.cost() - 12.0).abs() < 1e-12);
/// assert!((best.input("u", 0.3)? - 2.4).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
pub struct OptimalControl<'m, M, const N: usize> {
    model: &'m M,
    element: Element,
    elements: usize,
    weights: Vec<f64>,
    degree: Option<usize>,
    span: Range<f64>,
    conditions: Vec<Condition>,
    running: Vec<String>,
    end: Vec<String>,
    guess: Option<Curve<'m, N>>,
    inputs: Vec<(String, Source<'m>)>,
    control: Control,
}

/// The value of an input, by element, index of the input, and time.
type InputValue<'c> = dyn Fn(usize, usize, f64) -> f64 + 'c;

/// A function of time.
type Source<'m> = Box<dyn Fn(f64) -> f64 + 'm>;

impl<'m, M: Controlled<N>, const N: usize> OptimalControl<'m, M, N> {
    /// A problem for `model`, as yet without costs and conditions.
    pub fn of(model: &'m M) -> Self {
        Self {
            model,
            element: Mixed::<4>.into(),
            elements: 40,
            weights: Vec::new(),
            degree: None,
            span: f64::NAN..f64::NAN,
            conditions: Vec::new(),
            running: Vec::new(),
            end: Vec::new(),
            guess: None,
            inputs: Vec::new(),
            control: Control {
                tolerance: 1e-10,
                max_iterations: 200,
                progress: false,
            },
        }
    }

    /// Sets the element; `Mixed::<4>` by default.
    #[must_use]
    pub fn element(mut self, element: impl Into<Element>) -> Self {
        self.element = element.into();
        self
    }

    /// Sets the number of elements, all of the same length; 40 by default. Of this call and [`graded`](Self::graded)
    /// the last one counts.
    #[must_use]
    pub fn elements(mut self, elements: usize) -> Self {
        self.elements = elements;
        self.weights.clear();
        self
    }

    /// Sets one element for each weight, with lengths proportional to the weights.
    #[must_use]
    pub fn graded(mut self, weights: impl IntoIterator<Item = f64>) -> Self {
        self.weights = weights.into_iter().collect();
        self.elements = self.weights.len();
        self
    }

    /// Sets the degree of the input polynomials in each element; 0 holds an input constant over the element. At most
    /// one less than the number of points of the element.
    #[must_use]
    pub fn input_degree(mut self, degree: usize) -> Self {
        self.degree = Some(degree);
        self
    }

    /// Sets the span of time, which must go forwards.
    #[must_use]
    pub fn span(mut self, span: Range<f64>) -> Self {
        self.span = span;
        self
    }

    /// Sets the whole state at the start. Components of the end that are not set are free.
    #[must_use]
    pub fn from(self, start: State<N>) -> Self {
        (0..N).fold(self, |problem, a| {
            problem
                .start(Component::Coordinate(a), start.q[a])
                .start(Component::Momentum(a), start.p[a])
        })
    }

    /// Sets the whole state at the end.
    #[must_use]
    pub fn to(self, end: State<N>) -> Self {
        (0..N).fold(self, |problem, a| {
            problem
                .end(Component::Coordinate(a), end.q[a])
                .end(Component::Momentum(a), end.p[a])
        })
    }

    /// Sets the states at both ends, and the span.
    #[must_use]
    pub fn from_to(self, start: State<N>, end: State<N>, span: Range<f64>) -> Self {
        self.from(start).to(end).span(span)
    }

    /// Sets one component at the start; components that are not set are free.
    #[must_use]
    pub fn start(mut self, component: Component, value: f64) -> Self {
        self.conditions.push(Condition {
            at_end: false,
            component,
            value,
        });
        self
    }

    /// Sets one component at the end; components that are not set are free.
    #[must_use]
    pub fn end(mut self, component: Component, value: f64) -> Self {
        self.conditions.push(Condition {
            at_end: true,
            component,
            value,
        });
        self
    }

    /// Adds the time integral of an output to the cost.
    #[must_use]
    pub fn running_cost(mut self, output: &str) -> Self {
        self.running.push(output.to_owned());
        self
    }

    /// Adds the value of an output at the end to the cost. The output must not depend on inputs.
    #[must_use]
    pub fn end_cost(mut self, output: &str) -> Self {
        self.end.push(output.to_owned());
        self
    }

    /// Sets the first guess of the motion: a curve t ↦ (q, dq/dt), which need not satisfy the equations of motion.
    #[must_use]
    pub fn guess(mut self, curve: impl Fn(f64) -> ([f64; N], [f64; N]) + 'm) -> Self {
        self.guess = Some(Box::new(curve));
        self
    }

    /// Sets the first guess of an input; of several calls for one input the last one counts.
    #[must_use]
    pub fn guess_input(mut self, input: &str, function: impl Fn(f64) -> f64 + 'm) -> Self {
        self.inputs.retain(|(own, _)| own != input);
        self.inputs.push((input.to_owned(), Box::new(function)));
        self
    }

    /// Sets when the iteration is finished: when the last correction, relative to the solution, is at most this; 10⁻¹⁰
    /// by default. That correction is still applied, and convergence is quadratic, so that the remaining error is
    /// about its square.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.control.tolerance = tolerance;
        self
    }

    /// Sets the largest number of iterations, 200 by default.
    #[must_use]
    pub fn max_iterations(mut self, iterations: usize) -> Self {
        self.control.max_iterations = iterations;
        self
    }

    /// Shows every iteration on standard error.
    #[must_use]
    pub fn progress(mut self) -> Self {
        self.control.progress = true;
        self
    }

    /// Solves the problem.
    ///
    /// # Errors
    /// [`OptimalControlError`], whose [kind](OptimalControlErrorKind) is, for an invalid problem,
    /// [`Ends`](OptimalControlErrorKind::Ends), [`Backwards`](OptimalControlErrorKind::Backwards),
    /// [`Model`](OptimalControlErrorKind::Model), [`Element`](OptimalControlErrorKind::Element),
    /// [`Constrained`](OptimalControlErrorKind::Constrained), [`NoCost`](OptimalControlErrorKind::NoCost),
    /// [`UnknownOutput`](OptimalControlErrorKind::UnknownOutput),
    /// [`EndCostOfInput`](OptimalControlErrorKind::EndCostOfInput), [`Input`](OptimalControlErrorKind::Input),
    /// [`Degree`](OptimalControlErrorKind::Degree), [`Tolerance`](OptimalControlErrorKind::Tolerance) or
    /// [`Legendre`](OptimalControlErrorKind::Legendre). If no minimum was found from the guess, it is
    /// [`Undefined`](OptimalControlErrorKind::Undefined), [`Singular`](OptimalControlErrorKind::Singular),
    /// [`Stalled`](OptimalControlErrorKind::Stalled) or [`NoMinimum`](OptimalControlErrorKind::NoMinimum), and the error
    /// holds the last iterate.
    pub fn solve(&self) -> Result<Optimum<N>, OptimalControlError<N>> {
        self.check()?;
        let (running, end) = (self.columns(&self.running)?, self.columns(&self.end)?);
        self.check_end(&end)?;
        let mesh = Mesh::new(self.elements, &self.weights).map_err(BoundaryError::Mesh)?;
        let table = SchemeTable::new(self.element)?;
        let scheme = table.view();
        let degree = self.degree.unwrap_or(scheme.rates() - 1);
        let largest = scheme.points() - 1;
        if degree > largest {
            return Err(OptimalControlErrorKind::Degree { degree, largest }.into());
        }
        let coefficients = degree + 1;
        let sizes = Sizes::new(M::FORM, N, &scheme, M::INPUTS.len(), coefficients);
        let length = self.span.end - self.span.start;
        let said = Said::<M, N>(self.model);
        let transcribed = |mesh: &Mesh| {
            let places = (0..mesh.elements()).map(|e| mesh.place(e, self.span.start, length));
            let places: Vec<_> = places.collect();
            let block = |place| transcription::element(M::FORM, &scheme, &sizes, place, &running);
            let problem = Problem {
                model: &said,
                sizes,
                blocks: places.iter().map(|place| block(*place)).collect(),
                end: (!end.is_empty()).then(|| transcription::end(M::FORM, N, self.span.end, &end)),
                lengths: places.iter().map(|(_, h)| *h).collect(),
                ends: self.ends(),
            };
            (problem, places)
        };
        let (problem, places) = transcribed(&mesh);
        let halves = mesh.halved();
        let mut iterate = self.guessed(&table, &problem, &places)?;
        let mut history = Vec::new();
        let searched = problem.solve(&mut iterate, self.control, &mut history);
        let iterations = history.len();
        let optimum = self.optimum(&problem, &table, mesh, &iterate, history);
        let kind = match searched {
            Ok(()) => {
                let (fine, places) = transcribed(&halves);
                let warnings = self.doubts(&table, (&fine, &places), &optimum);
                return Ok(optimum.with_warnings(warnings));
            }
            Err(Failure::Undefined { element }) => OptimalControlErrorKind::Undefined {
                element,
                time: places.get(element).map_or(self.span.end, |(t, _)| *t),
                iterations,
            },
            Err(Failure::NoMinimum { element }) => OptimalControlErrorKind::NoMinimum {
                element,
                time: places.get(element).map_or(self.span.end, |(t, _)| *t),
                iterations,
            },
            Err(Failure::Singular) => OptimalControlErrorKind::Singular { iterations },
            Err(Failure::Stalled { correction }) => OptimalControlErrorKind::Stalled {
                iterations,
                correction,
                tolerance: self.control.tolerance,
            },
        };
        Err(OptimalControlError::with(kind, optimum))
    }

    fn check(&self) -> Result<(), OptimalControlErrorKind> {
        (self.model.check()).map_err(OptimalControlErrorKind::Model)?;
        if !is_tolerance(self.control.tolerance) {
            return Err(OptimalControlErrorKind::Tolerance {
                tolerance: self.control.tolerance,
            });
        }
        check_span(&self.span)?;
        if self.span.end < self.span.start {
            return Err(OptimalControlErrorKind::Backwards);
        }
        check_conditions::<N>(&self.conditions)?;
        if let Some(constraint) = M::CONSTRAINTS.first() {
            return Err(OptimalControlErrorKind::Constrained {
                constraint: constraint.name,
            });
        }
        if self.running.is_empty() && self.end.is_empty() {
            return Err(OptimalControlErrorKind::NoCost);
        }
        for (name, _) in &self.inputs {
            place(M::INPUTS, name)?;
        }
        Ok(())
    }

    /// The columns of the outputs that are costs.
    fn columns(&self, names: &[String]) -> Result<Vec<usize>, OptimalControlErrorKind> {
        let columns = 0..self.model.columns();
        let find = |name: &String| {
            let mut own = columns.clone();
            let found = own.find(|column| self.model.column_name(*column).is(name));
            found.ok_or_else(|| OptimalControlErrorKind::UnknownOutput {
                name: name.clone(),
                known: columns
                    .clone()
                    .map(|column| self.model.column_name(column).to_string())
                    .collect(),
            })
        };
        names.iter().map(find).collect()
    }

    /// Refuses a cost of the end that depends on an input: inputs have no value of their own there.
    fn check_end(&self, columns: &[usize]) -> Result<(), OptimalControlErrorKind> {
        for input in 0..M::INPUTS.len() {
            let holding = dependence::holding::<M, N>(self.model, input);
            for (column, name) in columns.iter().zip(&self.end) {
                if holding[*column] {
                    return Err(OptimalControlErrorKind::EndCostOfInput {
                        output: name.clone(),
                        input: M::INPUTS[input],
                    });
                }
            }
        }
        Ok(())
    }

    fn ends(&self) -> Ends {
        let mut ends = Ends {
            first: vec![false; 2 * N],
            last: vec![false; 2 * N],
        };
        for condition in &self.conditions {
            let given = match condition.at_end {
                true => &mut ends.last,
                false => &mut ends.first,
            };
            if let Some(place) = condition.component.place::<N>() {
                given[place] = true;
            }
        }
        ends
    }

    /// The first iterate on the mesh, from the guess.
    fn guessed(
        &self,
        table: &SchemeTable,
        problem: &Problem<'_>,
        places: &[(f64, f64)],
    ) -> Result<Iterate, OptimalControlErrorKind> {
        let line = Box::new(straight(&self.conditions, &self.span)) as Curve<'_, N>;
        let curve = self.guess.as_ref().unwrap_or(&line);
        let source = |name: &&str| {
            let given = self.inputs.iter().find(|(own, _)| own == name);
            given.map(|(_, function)| function)
        };
        let sources: Vec<_> = M::INPUTS.iter().map(source).collect();
        let value = |_: usize, input: usize, t: f64| sources[input].map_or(0.0, |u| u(t));
        self.first(table, problem, places, (curve, &value))
    }

    /// An iterate on the mesh without multipliers, along a curve and with the inputs by element, number and time;
    /// prescribed components at the ends are satisfied.
    fn first(
        &self,
        table: &SchemeTable,
        problem: &Problem<'_>,
        places: &[(f64, f64)],
        (curve, input_value): (&Curve<'_, N>, &InputValue<'_>),
    ) -> Result<Iterate, OptimalControlErrorKind> {
        let scheme = table.view();
        let sizes = problem.sizes;
        let state = |t: f64| {
            let (q, v) = curve(t);
            tfe_runtime::legendre::state(self.model, t, &q, &v)
        };
        let node = |t: f64| state(t).map(|s| DVector::from_vec([s.p, s.q].concat()));
        let mut iterate = Iterate {
            nodes: vec![node(self.span.start)?],
            interiors: Vec::new(),
            steering: Vec::new(),
            multipliers: vec![DVector::zeros(sizes.interior); places.len()],
            costates: vec![DVector::zeros(2 * N); places.len() + 1],
        };
        for (element, (t, h)) in places.iter().enumerate() {
            iterate.nodes.push(node(t + h)?);
            let mut interior = Vec::with_capacity(sizes.interior);
            for at in scheme.unknown_nodes {
                interior.extend(curve(t + at * h).1);
            }
            if M::FORM == Form::Hamiltonian {
                for at in scheme.nodes {
                    interior.extend(state(t + at * h)?.p);
                }
            }
            iterate.interiors.push(DVector::from_vec(interior));
            let mut steering = DVector::zeros(sizes.steering());
            for input in 0..M::INPUTS.len() {
                // The coefficient of P_k: ∫ P_k u divided by ∫ P_k².
                let mut basis = [0.0; MAX_NODES];
                for (at, weight) in scheme.nodes.iter().zip(scheme.weights) {
                    legendre(*at, &mut basis);
                    let value = weight * input_value(element, input, t + at * h);
                    for k in 0..sizes.coefficients {
                        steering[k * sizes.inputs + input] += (2 * k + 1) as f64 * basis[k] * value;
                    }
                }
            }
            iterate.steering.push(steering);
        }
        for condition in &self.conditions {
            let node = match condition.at_end {
                true => iterate.nodes.last_mut(),
                false => iterate.nodes.first_mut(),
            };
            if let (Some(node), Some(place)) = (node, condition.component.place::<N>()) {
                node[place] = condition.value;
            }
        }
        if let Some(end) = &problem.end {
            let velocity = if end.interior > 0 {
                curve(self.span.end).1.to_vec()
            } else {
                Vec::new()
            };
            iterate.interiors.push(DVector::from_vec(velocity));
            iterate.multipliers.push(DVector::zeros(end.interior));
        }
        Ok(iterate)
    }

    fn optimum(
        &self,
        problem: &Problem<'_>,
        table: &SchemeTable,
        mesh: Mesh,
        iterate: &Iterate,
        history: Vec<Iteration>,
    ) -> Optimum<N> {
        let Range { start, end } = self.span;
        let pieces = optimum::Pieces {
            times: mesh.times_to(end, start, end - start),
            inputs: problem.sizes.inputs,
            coefficients: iterate
                .steering
                .iter()
                .map(|part| part.as_slice().to_vec())
                .collect(),
        };
        let found = optimum::Found {
            model: self.model,
            element: self.element,
            span: self.span.clone(),
            mesh,
            pieces: Arc::new(pieces),
            iterations: history.len(),
        };
        let motion = found.motion(problem, &table.view(), iterate);
        Optimum {
            cost: problem.cost(iterate),
            motion,
            names: M::INPUTS,
            costates: found.costates(iterate),
            pieces: found.pieces,
            history,
            warnings: Vec::new(),
        }
    }
}
