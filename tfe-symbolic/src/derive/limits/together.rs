//! Sums whose terms have no limit where a norm vanishes, but which have one.
//!
//! ```text
//! h = √(x² + y²)       ∂(tanh(h/ε) x/h)/∂x = tanh(h/ε) y²/h³ + (1 − tanh²(h/ε)) x²/(ε h²)  →  { 1/ε  where h ≤ 10⁻¹⁰⁰;  …  elsewhere }
//! ```
//!
//! Along a direction, x = s cos φ, y = s sin φ, h = s, each term is c sⁿ for small s. Where no degree n is negative and
//! the c of degree zero add up to the same expression in several directions, that is the limit: here sin²φ/ε + cos²φ/ε. In
//! other cases the sum is unchanged, as x²/h² is. Directions are rational, so that equal sums are equal expressions.

use super::facts::{factors_of, is_at_rest, is_field};
use super::norm::{MAX_DEPTH, MAX_SUMS, Norm, is_small_with_its_argument};
use super::norms::Norms;
use super::powers::ROUNDING;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;

/// The depth to which terms are searched.
const MAX_LEVELS: usize = 8;

/// Sums are multiplied out to at most this number of terms.
const MAX_TERMS: usize = 64;

/// Below this norm its third power is subnormal, and a term that is divided by it not a number. The limit has all digits there.
const TINY: f64 = 1e-100;

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

/// The limit of a sum where a norm vanishes, if it has one.
fn limit_of_sum(graph: &mut Graph, norm: &Norm, sum: ExprId) -> Option<ExprId> {
    let axes = axes(graph, norm.root?)?;
    let expanded = graph.expanded_within(sum, MAX_TERMS)?;
    let (number, terms) = graph.terms(expanded);
    let mut limit: Option<ExprId> = None;
    for (components, length) in DIRECTIONS {
        let (own, others) = components.split_at(axes.len());
        if others.iter().any(|component| *component != 0) {
            continue;
        }
        let direction = Direction::of(graph, norm, &axes, (own, length))?;
        let along = direction.limit(graph, number, &terms)?;
        if limit.is_some_and(|known| known != along) {
            return None;
        }
        limit = Some(along);
    }
    limit
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
    norm: &'a Norm,
    /// The parts, and what they are where the norm is one; `None` for zero.
    parts: Vec<(ExprId, Option<ExprId>)>,
    /// What changes along it.
    inputs: Vec<Input>,
}

impl<'a> Direction<'a> {
    fn of(
        graph: &mut Graph,
        norm: &'a Norm,
        axes: &[Axis],
        (components, length): (&[i64], i64),
    ) -> Option<Self> {
        let mut parts = Vec::with_capacity(axes.len());
        let mut inputs = Vec::new();
        for (axis, component) in axes.iter().zip(components) {
            let share = Constant::rational(i128::from(*component), i128::from(length))?;
            let value = (!share.is_zero()).then(|| graph.scale(share, axis.unit));
            parts.push((axis.part, value));
            let moving = graph.inputs_of(axis.part).into_iter();
            inputs.extend(moving.filter(|input| !is_at_rest(input)));
        }
        Some(Self {
            norm,
            parts,
            inputs,
        })
    }

    /// The sum of the parts of degree zero; `None` if there is a part of lower degree, or one that is not known.
    fn limit(
        &self,
        graph: &mut Graph,
        number: Constant,
        terms: &[(Constant, ExprId)],
    ) -> Option<ExprId> {
        let mut parts = Vec::with_capacity(terms.len());
        for (c, term) in terms {
            match self.along(graph, *term, MAX_LEVELS)? {
                Along::Lead(lead) if lead.degree < -ROUNDING => return None,
                Along::Lead(lead) if lead.degree <= ROUNDING => parts.push((*c, lead.coefficient)),
                Along::Lead(_) | Along::Zero => {}
            }
        }
        Some(graph.linear(number, &parts))
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
        if Some(x) == self.norm.root {
            return Some(Along::lead(1.0, one));
        }
        if Some(x) == self.norm.square && self.norm.is_plain {
            return Some(Along::lead(2.0, one));
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
            Node::Call {
                function,
                arguments,
            } => match arguments[..] {
                [argument] => self.along_function(graph, (x, function), argument, depth),
                _ => Some(self.as_it_is(graph, x)),
            },
            _ => Some(self.as_it_is(graph, x)),
        }
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
        let cancels = graph
            .as_constant(coefficient)
            .is_some_and(Constant::is_zero);
        (!cancels).then(|| {
            Along::Lead(Lead {
                degree: least,
                coefficient,
                is_exact: leads.iter().all(|(_, lead)| lead.is_exact),
            })
        })
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
