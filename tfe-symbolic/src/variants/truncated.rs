//! Taylor polynomials of the energy about a point of the phase space, (T-104).
//!
//! ```text
//! L_k(q, v, t) = Σ_{j ≤ k} 1/j! Dʲ L(q₀, v₀, t)[δ, …, δ] ,     δ = (q − q₀, v − v₀)
//! ```
//!
//! The derivatives are directional ones, the direction is a leaf of its own that later derivatives hold fixed: that goes through sums over
//! ranges as it does through anything else, whatever their length.

use super::removal::written_out_forces;
use super::target::Places;
use super::{Assignment, Mistake, Reduction};
use crate::diagnostic::Kind;
use crate::expr::constant::Constant;
use crate::expr::differentiate::directional;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::{Affine, Input};
use crate::expr::ordered::{SortedMap, SortedSet};
use crate::expr::rewrite::Mapping;
use crate::model::declared::Form;

/// The parts of a state. While derivatives are taken, placeholders of these numbers stand for q − q₀, v − v₀ and p − p₀.
const PARTS: [fn(Affine) -> Input; 3] = [Input::Coordinate, Input::Velocity, Input::Momentum];
const PASS: &str = "truncated";

/// The values of one half of the state.
#[derive(Clone, Debug, Default)]
struct Values {
    /// Of all places that have none of their own; zero where nothing is said.
    all: Option<ExprId>,
    own: SortedMap<i64, ExprId>,
}

impl Values {
    fn at(&self, index: &Affine) -> Option<ExprId> {
        let own = index.as_constant().and_then(|at| self.own.get(&at));
        own.copied().or(self.all)
    }

    /// Whether something is said twice.
    fn set(&mut self, places: Places, value: ExprId) -> bool {
        match places {
            Places::All => self.all.replace(value).is_some(),
            Places::Numbers(places) => {
                let mut twice = false;
                for place in places {
                    twice |= self.own.insert(place, value).is_some();
                }
                twice
            }
        }
    }
}

/// q₀ and v₀ or p₀.
#[derive(Clone, Debug, Default)]
struct Point {
    q: Values,
    z: Values,
}

impl Point {
    /// The values of the half of the state that a leaf belongs to, its index, and its number among [`PARTS`].
    fn half<'a>(&'a self, input: &'a Input) -> Option<(&'a Values, &'a Affine, u32)> {
        match input {
            Input::Coordinate(at) => Some((&self.q, at, 0)),
            Input::Velocity(at) => Some((&self.z, at, 1)),
            Input::Momentum(at) => Some((&self.z, at, 2)),
            _ => None,
        }
    }

    /// Whether places differ, so that indices must be numbers.
    fn is_by_place(&self) -> bool {
        !(self.q.own.is_empty() && self.z.own.is_empty())
    }
}

impl Reduction {
    pub(super) fn truncate(
        &mut self,
        degree: u32,
        point: &[Assignment],
        place: impl Fn(Kind) -> Mistake,
    ) -> Result<(), Mistake> {
        if !self.model.constraints.is_empty() {
            return Err(place(Kind::TruncationOfConstraints));
        }
        let point = self.point(point)?;
        if point.is_by_place() {
            self.model.forces = written_out_forces(&mut self.model, PASS).map_err(&place)?;
        }
        let energy = self.model.energy;
        self.model.energy = self.polynomial(energy, degree, &point).map_err(&place)?;
        if let Some(dissipation) = self.model.dissipation {
            let truncated = self.polynomial(dissipation, degree, &point);
            self.model.dissipation = Some(truncated.map_err(&place)?);
        }
        for at in 0..self.model.forces.len() {
            let force = self.model.forces[at].value;
            let truncated = self.polynomial(force, degree - 1, &point);
            self.model.forces[at].value = truncated.map_err(&place)?;
        }
        Ok(())
    }

    fn point(&self, assignments: &[Assignment]) -> Result<Point, Mistake> {
        let model = &self.model;
        let mut point = Point::default();
        for Assignment {
            target,
            span,
            value,
        } in assignments
        {
            let is_momentum = |name: &str| model.momenta.iter().any(|array| array.name == name);
            let wrong = |kind| (*span, kind);
            let (half, arrays) = match (target.rate, model.form) {
                (true, Form::Hamiltonian) => {
                    return Err(wrong(Kind::VelocityInHamiltonian { via: None }));
                }
                (true, Form::Lagrangian) => (&mut point.z, &model.coordinates),
                (false, _) if is_momentum(&target.name) => (&mut point.z, &model.momenta),
                (false, _) => (&mut point.q, &model.coordinates),
            };
            let places = target.places(arrays, PASS).map_err(wrong)?;
            if half.set(places, *value) {
                let name = target.to_string();
                return Err(wrong(Kind::RepeatedEntry { name }));
            }
        }
        Ok(point)
    }

    /// The Taylor polynomial of an expression.
    fn polynomial(&mut self, of: ExprId, degree: u32, point: &Point) -> Result<ExprId, Kind> {
        let graph = &mut self.model.graph;
        let mut of = of;
        if point.is_by_place() && graph.holds_varying_index(of) {
            of = graph.unroll(of).unwrap_or(of);
            if graph.holds_varying_index(of) {
                return Err(Kind::PassOfLength { pass: PASS });
            }
        }
        let sum = series(graph, of, degree, point)?;
        let mapping = about(graph, sum, point, None);
        let polynomial = mapping.of(sum);
        if is_singular(graph, polynomial)
            || divides_by_zero(graph, sum, &mapping)
            || has_kink(graph, sum, point, &mapping)
        {
            return Err(Kind::NoTaylorPolynomial);
        }
        let is_long = || graph.reachable(&[polynomial]).len() > MAX_OF_HIGH_DEGREE;
        if degree > MAX_FREE_DEGREE && is_long() {
            return Err(Kind::LongTaylorPolynomial { degree });
        }
        // Derivatives of different order share terms.
        let (constant, terms) = graph.terms(polynomial);
        Ok(graph.linear(constant, &terms))
    }
}

/// Derivatives of third and higher order may be made of so many expressions. Of 10 000, the next order takes half a minute.
const MAX_EXPRESSIONS: usize = 3000;

/// Above this degree, polynomials may be made of so many expressions: that of a double pendulum to degree 12 has 237, and of 1200 the kernels take
/// more than a second; a polynomial of degree 6 of one of degree 6 about another point once had 2200.
const MAX_FREE_DEGREE: u32 = 5;
const MAX_OF_HIGH_DEGREE: usize = 800;

/// Σ 1/j! Dʲ f[δ, …, δ] with placeholders for δ.
fn series(graph: &mut Graph, of: ExprId, degree: u32, point: &Point) -> Result<ExprId, Kind> {
    let mut terms = vec![(Constant::ONE, of)];
    let mut derivative = of;
    let mut factorial = 1;
    for order in 1..=degree {
        derivative = directional(graph, derivative, &mut |graph, input| {
            let (_, at, part) = point.half(input)?;
            Some(graph.input(Input::Placeholder(part, at.clone())))
        });
        if order > 2 && graph.reachable(&[derivative]).len() > MAX_EXPRESSIONS {
            return Err(Kind::LongTaylorPolynomial { degree: order });
        }
        // 12! is far from the largest integer.
        factorial *= i64::from(order);
        let factor = Constant::integer(factorial).reciprocal();
        terms.push((factor.unwrap_or(Constant::ZERO), derivative));
    }
    Ok(graph.linear(Constant::ZERO, &terms))
}

/// What each part of a series is about the point; one choice may be made otherwise.
fn about(
    graph: &mut Graph,
    series: ExprId,
    point: &Point,
    otherwise: Option<(ExprId, Side)>,
) -> Mapping {
    graph.with_nodes(series, &mut |graph, old, mapping| match otherwise {
        Some((choice, Side::Of(branch))) if choice == old => Some(mapping.of(branch)),
        Some((choice, Side::Sign(sign))) if choice == old => Some(graph.integer(sign)),
        _ => match graph.node(old).clone() {
            Node::Input(input) => at_point(graph, &input, point),
            _ => None,
        },
    })
}

/// Whether something is divided by zero about the point, be it multiplied by zero: `norm([x, y])` at the origin.
fn divides_by_zero(graph: &Graph, series: ExprId, mapping: &Mapping) -> bool {
    let (mut waiting, mut seen) = (vec![series], SortedSet::new());
    while let Some(id) = waiting.pop() {
        if !seen.insert(id) {
            continue;
        }
        match graph.node(id) {
            // What is not chosen does not count.
            Node::Select { then, .. } if mapping.of(id) == mapping.of(*then) => {
                waiting.push(*then);
            }
            Node::Select { otherwise, .. } if mapping.of(id) == mapping.of(*otherwise) => {
                waiting.push(*otherwise);
            }
            Node::Product(factors) => {
                if (factors.iter()).any(|(x, n)| *n < 0 && is_zero(graph, mapping.of(*x))) {
                    return true;
                }
                waiting.extend(factors.iter().map(|(x, _)| *x));
            }
            node => waiting.extend(node.children()),
        }
    }
    false
}

/// What a choice may be where both sides meet.
#[derive(Clone, Copy)]
enum Side {
    Of(ExprId),
    Sign(i64),
}

/// Whether the point lies where two sides of a choice meet and the polynomials of both are not the same: that of `abs(x)*x` to degree one about 0 is 0, and
/// `abs(x)` has none.
fn has_kink(graph: &mut Graph, series: ExprId, point: &Point, mapping: &Mapping) -> bool {
    let mut between = Vec::new();
    for id in graph.reachable(&[series]) {
        match graph.node(id) {
            Node::Select {
                left,
                right,
                then,
                otherwise,
                ..
            } if is_tie(graph, mapping.of(*left), mapping.of(*right)) => {
                between.extend([(id, Side::Of(*then)), (id, Side::Of(*otherwise))]);
            }
            Node::Call {
                function: Function::Sign,
                arguments,
            } if arguments.iter().all(|x| is_zero(graph, mapping.of(*x))) => {
                between.extend([(id, Side::Sign(1)), (id, Side::Sign(-1))]);
            }
            _ => {}
        }
    }
    between
        .into_iter()
        .any(|choice| about(graph, series, point, Some(choice)).of(series) != mapping.of(series))
}

fn is_tie(graph: &Graph, left: ExprId, right: ExprId) -> bool {
    left == right || (is_zero(graph, left) && is_zero(graph, right))
}

fn is_zero(graph: &Graph, id: ExprId) -> bool {
    graph
        .as_constant(id)
        .is_some_and(|value| value.to_f64() == 0.0)
}

/// q₀ for q, and q − q₀ for its placeholder.
fn at_point(graph: &mut Graph, input: &Input, point: &Point) -> Option<ExprId> {
    if let Some((values, at, _)) = point.half(input) {
        return Some(match values.at(at) {
            Some(value) => value,
            None => graph.integer(0),
        });
    }
    let Input::Placeholder(part, at) = input else {
        return None;
    };
    let input = PARTS.get(*part as usize)?(at.clone());
    let state = graph.input(input.clone());
    Some(match point.half(&input)?.0.at(at) {
        Some(value) => graph.subtract(state, value),
        None => state,
    })
}

/// Whether a part without leaves has no value: what has one is a number.
fn is_singular(graph: &Graph, id: ExprId) -> bool {
    let constant = |id: &ExprId| graph.as_constant(*id);
    graph
        .reachable(&[id])
        .into_iter()
        .any(|id| match graph.node(id) {
            Node::Constant(value) => !value.to_f64().is_finite(),
            Node::Input(_) | Node::Loop { .. } | Node::Sum { .. } => false,
            // A number stays a factor only where it is zero to a negative power.
            Node::Product(factors) => factors.iter().any(|(x, _)| constant(x).is_some()),
            node => node
                .children()
                .iter()
                .all(|child| constant(child).is_some()),
        })
}
