//! Sums whose terms have no limit where a norm vanishes, but which have one.
//!
//! ```text
//! h = √(x² + y²)       ∂(tanh(h/ε) x/h)/∂x = tanh(h/ε) y²/h³ + (1 − tanh²(h/ε)) x²/(ε h²)  →  { 1/ε  where h ≤ 10⁻¹⁰⁰;  …  elsewhere }
//! ```
//!
//! Along a direction, x = s cos φ, y = s sin φ, h = s, each term is c sⁿ for small s. Where no degree n is negative and
//! the c of degree zero add up to the same expression in several directions, that is the limit: here sin²φ/ε + cos²φ/ε. In
//! other cases the sum is unchanged, as x²/h² is. Directions are rational, so that equal sums are equal expressions.

use super::facts::{MAX_TERMS, factors_of, is_at_rest, is_equal, is_field, is_zero, times_terms};
use super::norm::{MAX_DEPTH, MAX_SUMS, Norm, is_small_with_its_argument};
use super::norms::Norms;
use super::powers::ROUNDING;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::differentiate::derivative;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::{Affine, Input};

/// The depth to which terms are searched.
const MAX_LEVELS: usize = 12;

/// Below this norm its third power is subnormal, and a term that is divided by it not a number. The limit has all digits there.
pub(super) const TINY: f64 = 1e-100;

/// Components of directions and their length: axes, and some in between. A norm of fewer parts has those whose further
/// components are zero.
const DIRECTIONS: [([i64; 4], i64); 13] = [
    ([1, 0, 0, 0], 1),
    ([0, 1, 0, 0], 1),
    ([0, 0, 1, 0], 1),
    ([0, 0, 0, 1], 1),
    ([3, 4, 0, 0], 5),
    ([3, -4, 0, 0], 5),
    ([0, 3, 4, 0], 5),
    ([4, 0, 3, 0], 5),
    ([0, 0, 3, 4], 5),
    ([1, 2, 2, 0], 3),
    ([1, -2, 2, 0], 3),
    ([1, 1, 1, 1], 2),
    ([1, -1, 1, 1], 2),
];

/// The list of the placeholder of the norm along a direction.
const LENGTH: u32 = 2;

/// The list of the placeholders of its parts.
const PART: u32 = 3;

/// The placeholder of the norm along a direction.
fn length() -> Input {
    Input::Placeholder(LENGTH, Affine::constant(0))
}

/// What finds limits of sums.
#[derive(Default)]
pub(super) struct Together {
    /// A copy in which limits are sought: most sums have none, and expressions made in vain would change the order of later ones.
    trial: Option<Graph>,
}

impl Together {
    /// A sum with its limit where a norm vanishes. `new` is what has become of the sum `old` by the limits of its terms.
    pub(super) fn limit(
        &mut self,
        graph: &mut Graph,
        norms: &mut Norms,
        (old, new): (ExprId, ExprId),
    ) -> ExprId {
        if graph.as_sum(old).is_none() {
            return new;
        }
        let inner = graph.as_multiple(new).1;
        for norm in norms.of_sum(graph, old, MAX_SUMS - 1) {
            let Some(root) = norm.root.filter(|_| norm.has_parts()) else {
                continue;
            };
            let degree = norm.degree(graph, old, MAX_DEPTH);
            // A sum of higher degree is zero with its terms, whatever the signs are.
            let is_left = norm.diverges(graph, (inner, 1), MAX_SUMS)
                || (degree <= ROUNDING && has_sign_that_vanishes(graph, &norm, inner));
            if !is_left || degree < -ROUNDING {
                continue;
            }
            let trial = self.trial.get_or_insert_with(|| graph.clone());
            if limit_of_sum(trial, &norm, old).is_none() {
                continue;
            }
            if let Some(limit) = limit_of_sum(graph, &norm, old) {
                let tiny = graph.constant(Constant::float(TINY));
                return graph.select(Comparison::LessOrEqual, root, tiny, limit, new);
            }
        }
        new
    }
}

/// Whether there is the sign of something in a sum that vanishes with a norm, as of sin h: it is zero there, and one in all directions.
fn has_sign_that_vanishes(graph: &Graph, norm: &Norm, sum: ExprId) -> bool {
    let (_, terms) = graph.terms(sum);
    let mut factors = terms.iter().flat_map(|(_, term)| factors_of(graph, *term));
    factors.any(|(y, _)| match graph.node(y) {
        Node::Call {
            function: Function::Sign,
            arguments,
        } => {
            let mut degrees = arguments.iter().map(|z| norm.degree(graph, *z, MAX_DEPTH));
            degrees.any(|degree| degree > ROUNDING)
        }
        _ => false,
    })
}

/// The limit of an expression where a norm vanishes, if it has one.
pub(super) fn limit_of_sum(graph: &mut Graph, norm: &Norm, sum: ExprId) -> Option<ExprId> {
    let polar = Polar::of(graph, norm)?;
    let sum = polar.enter(graph, sum);
    let limit = match polar.limit(graph, sum) {
        Some(limit) => limit,
        None => {
            let expanded = graph.expanded_within(sum, MAX_TERMS)?;
            polar.limit(graph, expanded)?
        }
    };
    Some(polar.leave(graph, limit))
}

/// Placeholders for a norm and its parts, so that sums are multiplied out but not parts that are sums themselves.
struct Polar {
    axes: Vec<Axis>,
    /// What is replaced by placeholders.
    entering: Vec<(ExprId, ExprId)>,
    leaving: Vec<(ExprId, ExprId)>,
    /// What changes with the norm.
    inputs: Vec<Input>,
}

impl Polar {
    fn of(graph: &mut Graph, norm: &Norm) -> Option<Self> {
        let root = norm.root?;
        let mut axes = axes(graph, root)?;
        let (mut inputs, leaf) = (vec![length()], graph.input(length()));
        let mut entering = vec![(root, leaf)];
        for (at, axis) in axes.iter_mut().enumerate() {
            let part = Input::Placeholder(PART, Affine::constant(i64::try_from(at).ok()?));
            let moving = graph.inputs_of(axis.part).into_iter();
            inputs.extend(moving.filter(|input| !is_at_rest(input)));
            inputs.push(part.clone());
            let part = graph.input(part);
            entering.push((axis.part, part));
            axis.part = part;
        }
        let leaving = entering.iter().map(|(node, leaf)| (*leaf, *node)).collect();
        if let Some(square) = norm.square.filter(|_| norm.is_plain) {
            entering.push((square, graph.multiply(leaf, leaf)));
        }
        Some(Self {
            axes,
            entering,
            leaving,
            inputs,
        })
    }

    fn enter(&self, graph: &mut Graph, x: ExprId) -> ExprId {
        replaced(graph, x, &self.entering)
    }

    fn leave(&self, graph: &mut Graph, x: ExprId) -> ExprId {
        replaced(graph, x, &self.leaving)
    }

    /// The limit that a sum has in several directions.
    fn limit(&self, graph: &mut Graph, sum: ExprId) -> Option<ExprId> {
        let mut limit: Option<ExprId> = None;
        for (components, length) in DIRECTIONS {
            let (own, others) = components.split_at(self.axes.len());
            if others.iter().any(|component| *component != 0) {
                continue;
            }
            let direction = Direction::of(graph, self, (own, length))?;
            let along = direction.limit(graph, sum)?;
            if limit.is_some_and(|known| !is_equal(graph, known, along)) {
                return None;
            }
            limit = Some(along);
        }
        limit
    }
}

/// An expression with nodes replaced by others.
pub(super) fn replaced(graph: &mut Graph, x: ExprId, nodes: &[(ExprId, ExprId)]) -> ExprId {
    let new = |old: ExprId| nodes.iter().find(|(node, _)| *node == old);
    let mapping = graph.with_nodes(x, &mut |_, old, _| new(old).map(|(_, new)| *new));
    mapping.of(x)
}

/// A part of a norm, and what it is where the norm is one and the others are zero.
struct Axis {
    part: ExprId,
    unit: ExprId,
}

/// The parts of a norm, of two to four, each a single factor beside fields.
fn axes(graph: &mut Graph, root: ExprId) -> Option<Vec<Axis>> {
    let Node::Call {
        function,
        arguments,
    } = graph.node(root).clone()
    else {
        return None;
    };
    let (terms, power) = match (function, &arguments[..]) {
        (Function::Hypot, [x, y]) => ([*x, *y].map(|x| graph.as_multiple(x)).to_vec(), 1),
        (Function::Sqrt, [square]) => (graph.terms(*square).1, 2),
        _ => return None,
    };
    let mut axes: Vec<Axis> = Vec::with_capacity(terms.len());
    for (c, term) in terms {
        let (mut weight, mut parts): (Vec<_>, Vec<_>) = factors_of(graph, term)
            .into_iter()
            .partition(|(y, _)| is_field(graph, *y));
        let (part, n) = parts.pop()?;
        if n != power || !parts.is_empty() || axes.iter().any(|axis| axis.part == part) {
            return None;
        }
        let number = graph.constant(c);
        weight.push((number, 1));
        let mut size = graph.product(Constant::ONE, &weight);
        if power == 2 {
            size = graph.call(Function::Sqrt, &[size]);
        }
        let one = graph.constant(Constant::ONE);
        let unit = graph.divide(one, size);
        axes.push(Axis { part, unit });
    }
    (2..=4).contains(&axes.len()).then_some(axes)
}

/// c sⁿ for small s.
struct Lead {
    degree: f64,
    coefficient: ExprId,
    /// Whether n is the degree itself, and not less than that.
    is_exact: bool,
}

/// What an expression is along a direction.
enum Along {
    Zero,
    Lead(Lead),
}

impl Along {
    fn lead(degree: f64, coefficient: ExprId) -> Self {
        Self::Lead(Lead {
            degree,
            coefficient,
            is_exact: true,
        })
    }
}

/// A direction in the space of the parts of a norm.
struct Direction<'a> {
    /// The parts, and what they are where the norm is one; `None` for zero.
    parts: Vec<(ExprId, Option<ExprId>)>,
    /// What changes along it.
    inputs: &'a [Input],
}

impl<'a> Direction<'a> {
    fn of(
        graph: &mut Graph,
        polar: &'a Polar,
        (components, length): (&[i64], i64),
    ) -> Option<Self> {
        let mut parts = Vec::with_capacity(polar.axes.len());
        for (axis, component) in polar.axes.iter().zip(components) {
            let share = Constant::rational(i128::from(*component), i128::from(length))?;
            let value = (!share.is_zero()).then(|| graph.scale(share, axis.unit));
            parts.push((axis.part, value));
        }
        Some(Self {
            parts,
            inputs: &polar.inputs,
        })
    }

    /// The limit of a sum, of its terms or, where these have none, of all together.
    fn limit(&self, graph: &mut Graph, sum: ExprId) -> Option<ExprId> {
        let (number, terms) = graph.terms(sum);
        if let Some(limit) = self.limit_of_terms(graph, number, &terms) {
            return Some(limit);
        }
        self.part_of_degree_zero(graph, sum, MAX_LEVELS)
    }

    /// The sum of the parts of degree zero; `None` if there is a part of lower degree, or one that is not known.
    fn limit_of_terms(
        &self,
        graph: &mut Graph,
        number: Constant,
        terms: &[(Constant, ExprId)],
    ) -> Option<ExprId> {
        let mut parts = Vec::with_capacity(terms.len());
        for (c, term) in terms {
            parts.push((*c, self.part_of_degree_zero(graph, *term, MAX_LEVELS)?));
        }
        Some(graph.linear(number, &parts))
    }

    /// The limit of an expression; `None` if its degree is negative, or not known.
    fn part_of_degree_zero(&self, graph: &mut Graph, x: ExprId, depth: usize) -> Option<ExprId> {
        match self.along(graph, x, depth)? {
            Along::Lead(lead) if lead.degree < -ROUNDING => None,
            Along::Lead(lead) if lead.degree <= ROUNDING => Some(lead.coefficient),
            Along::Lead(_) | Along::Zero => Some(graph.constant(Constant::ZERO)),
        }
    }

    fn along(&self, graph: &mut Graph, x: ExprId, depth: usize) -> Option<Along> {
        let depth = depth.checked_sub(1)?;
        let (number, inner) = graph.as_multiple(x);
        if inner != x {
            return Some(match self.along(graph, inner, depth)? {
                Along::Zero => Along::Zero,
                Along::Lead(lead) => Along::Lead(Lead {
                    coefficient: graph.scale(number, lead.coefficient),
                    ..lead
                }),
            });
        }
        if let Some((_, value)) = self.parts.iter().find(|(part, _)| *part == x) {
            return Some(value.map_or(Along::Zero, |value| Along::lead(1.0, value)));
        }
        let one = graph.constant(Constant::ONE);
        if matches!(graph.node(x), Node::Input(input) if *input == length()) {
            return Some(Along::lead(1.0, one));
        }
        match graph.node(x).clone() {
            Node::Product(factors) => self.along_product(graph, &factors, depth),
            Node::Sum { constant, terms } => self.along_sum(graph, constant, &terms, depth),
            Node::Power { base, exponent } => {
                let number = graph.as_constant(exponent);
                match (self.along(graph, base, depth)?, number) {
                    (Along::Zero, Some(n)) if !n.is_negative() => Some(Along::Zero),
                    (Along::Lead(lead), Some(n)) => Some(Along::Lead(Lead {
                        degree: lead.degree * n.to_f64(),
                        coefficient: graph.power(lead.coefficient, exponent),
                        is_exact: lead.is_exact,
                    })),
                    (Along::Lead(lead), None) if lead.degree == 0.0 && lead.is_exact => {
                        Some(self.as_it_is(graph, x))
                    }
                    _ => None,
                }
            }
            Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let condition = (comparison, left, right);
                self.along_choice(graph, x, condition, [then, otherwise], depth)
            }
            Node::Call {
                function,
                arguments,
            } => match arguments[..] {
                [argument] => self.along_function(graph, (x, function), argument, depth),
                [y, z] if matches!(function, Function::Min | Function::Max) => {
                    let condition = (function.takes_first(), y, z);
                    self.along_choice(graph, x, condition, [y, z], depth)
                }
                _ => Some(self.as_it_is(graph, x)),
            },
            _ => Some(self.as_it_is(graph, x)),
        }
    }

    /// The branch of a choice that is taken near zero.
    fn along_choice(
        &self,
        graph: &mut Graph,
        x: ExprId,
        (comparison, left, right): (Comparison, ExprId, ExprId),
        [then, otherwise]: [ExprId; 2],
        depth: usize,
    ) -> Option<Along> {
        let difference = graph.subtract(left, right);
        let sign = match self.along(graph, difference, depth)? {
            Along::Zero => 0.0,
            Along::Lead(lead) => match graph.as_constant(lead.coefficient) {
                Some(number) if lead.is_exact => number.to_f64(),
                _ => return Some(self.as_it_is(graph, x)),
            },
        };
        let branch = match comparison.holds(sign, 0.0) {
            true => then,
            false => otherwise,
        };
        self.along(graph, branch, depth)
    }

    /// Its own value, which may be zero where the norm is if it changes along the direction.
    fn as_it_is(&self, graph: &Graph, x: ExprId) -> Along {
        let mut inputs = graph.inputs_of(x).into_iter();
        Along::Lead(Lead {
            degree: 0.0,
            coefficient: x,
            is_exact: !inputs.any(|input| self.inputs.contains(&input)),
        })
    }

    fn along_product(
        &self,
        graph: &mut Graph,
        factors: &[(ExprId, i32)],
        depth: usize,
    ) -> Option<Along> {
        let (mut degree, mut is_exact, mut is_zero) = (0.0, true, false);
        let mut coefficients = Vec::with_capacity(factors.len());
        for (y, n) in factors {
            match self.along(graph, *y, depth)? {
                Along::Zero if *n > 0 => is_zero = true,
                Along::Lead(lead) if *n > 0 || lead.is_exact => {
                    degree += f64::from(*n) * lead.degree;
                    is_exact &= lead.is_exact;
                    coefficients.push((lead.coefficient, *n));
                }
                _ => return None,
            }
        }
        if is_zero {
            return Some(Along::Zero);
        }
        Some(Along::Lead(Lead {
            degree,
            coefficient: graph.product(Constant::ONE, &coefficients),
            is_exact,
        }))
    }

    /// The terms of lowest degree; `None` where these cancel.
    fn along_sum(
        &self,
        graph: &mut Graph,
        constant: Constant,
        terms: &[(Constant, ExprId)],
        depth: usize,
    ) -> Option<Along> {
        let mut leads = Vec::with_capacity(terms.len());
        for (c, y) in terms {
            if let Along::Lead(lead) = self.along(graph, *y, depth)? {
                leads.push((*c, lead));
            }
        }
        if !constant.is_zero() {
            let coefficient = graph.constant(Constant::ONE);
            let number = Lead {
                degree: 0.0,
                coefficient,
                is_exact: true,
            };
            leads.push((constant, number));
        }
        let degrees = leads.iter().map(|(_, lead)| lead.degree);
        let Some(least) = degrees.reduce(f64::min) else {
            return Some(Along::Zero);
        };
        leads.retain(|(_, lead)| lead.degree <= least + ROUNDING);
        let lowest: Vec<(Constant, ExprId)> = leads
            .iter()
            .map(|(c, lead)| (*c, lead.coefficient))
            .collect();
        let coefficient = graph.linear(Constant::ZERO, &lowest);
        if is_zero(graph, coefficient) {
            let sum = graph.linear(constant, terms);
            return self.along_by_slope(graph, (sum, least), depth);
        }
        Some(Along::Lead(Lead {
            degree: least,
            coefficient,
            is_exact: leads.iter().all(|(_, lead)| lead.is_exact),
        }))
    }

    /// What a sum is whose terms of lowest degree cancel, from its slope along the direction: 1 − eʰ from −eʰ. Where that degree is negative,
    /// the sum is multiplied by a power of the norm.
    fn along_by_slope(
        &self,
        graph: &mut Graph,
        (sum, least): (ExprId, f64),
        depth: usize,
    ) -> Option<Along> {
        let leaf = length();
        let power = (-least - ROUNDING).ceil().max(0.0);
        let of_length = self.times_power(graph, sum, power as i32);
        let mut inputs = graph.inputs_of(of_length).into_iter();
        if inputs.any(|input| input != leaf && self.inputs.contains(&input)) {
            return None;
        }
        let slope = derivative(graph, of_length, &leaf);
        if is_zero(graph, slope) {
            return Some(Along::Zero);
        }
        let Along::Lead(lead) = self.along(graph, slope, depth)? else {
            return Some(Along::Zero);
        };
        let degree = lead.degree.round() + 1.0;
        let is_whole = (lead.degree - lead.degree.round()).abs() <= ROUNDING;
        if !lead.is_exact || !is_whole || degree < 1.0 {
            return None;
        }
        let times = Constant::integer(degree as i64).reciprocal()?;
        Some(Along::lead(
            degree - power,
            graph.scale(times, lead.coefficient),
        ))
    }

    /// A sum as an expression of the norm, times a power of that.
    fn times_power(&self, graph: &mut Graph, sum: ExprId, power: i32) -> ExprId {
        let s = graph.input(length());
        let mut values = Vec::with_capacity(self.parts.len());
        for (part, value) in &self.parts {
            let value = match value {
                Some(value) => graph.multiply(*value, s),
                None => graph.constant(Constant::ZERO),
            };
            values.push((*part, value));
        }
        let of_length = replaced(graph, sum, &values);
        let factor = graph.product(Constant::ONE, &[(s, power)]);
        let products = times_terms(graph, factor, of_length);
        graph.linear(Constant::ZERO, &products)
    }

    fn along_function(
        &self,
        graph: &mut Graph,
        (x, function): (ExprId, Function),
        argument: ExprId,
        depth: usize,
    ) -> Option<Along> {
        let is_small = is_small_with_its_argument(function);
        let is_one = matches!(function, Function::Cos | Function::Cosh | Function::Exp);
        if function == Function::Sign {
            return self.along_sign(graph, x, argument, depth);
        }
        if !is_small && !is_one && !matches!(function, Function::Sqrt | Function::Abs) {
            return Some(self.as_it_is(graph, x));
        }
        let one = graph.constant(Constant::ONE);
        match self.along(graph, argument, depth)? {
            Along::Zero if is_one => Some(Along::lead(0.0, one)),
            Along::Zero => Some(Along::Zero),
            Along::Lead(lead) if !is_small && !is_one => {
                let coefficient = graph.call(function, &[lead.coefficient]);
                let root = if function == Function::Sqrt { 0.5 } else { 1.0 };
                Some(Along::Lead(Lead {
                    degree: root * lead.degree,
                    coefficient,
                    is_exact: lead.is_exact,
                }))
            }
            Along::Lead(lead) if lead.degree < -ROUNDING => None,
            Along::Lead(lead) if lead.degree <= ROUNDING => Some(self.as_it_is(graph, x)),
            Along::Lead(_) if is_one => Some(Along::lead(0.0, one)),
            Along::Lead(lead) => Some(Along::Lead(lead)),
        }
    }

    /// The sign that something has near zero.
    fn along_sign(
        &self,
        graph: &mut Graph,
        x: ExprId,
        argument: ExprId,
        depth: usize,
    ) -> Option<Along> {
        match self.along(graph, argument, depth)? {
            Along::Lead(lead) if lead.is_exact => {
                let sign = graph.call(Function::Sign, &[lead.coefficient]);
                Some(Along::lead(0.0, sign))
            }
            Along::Lead(_) => Some(self.as_it_is(graph, x)),
            Along::Zero => Some(Along::Zero),
        }
    }
}
