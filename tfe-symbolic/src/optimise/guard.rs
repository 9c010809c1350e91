//! What a rewritten formula may do to the digits of results: no more harm than the formula as declared, at states where digits are easily lost.
//!
//! The formula as declared, differentiated plainly and evaluated in the order in which it stands, is the baseline. A plan of operations that
//! computes the same results is accepted if at each state
//!
//! * its results agree with those of the baseline within the rounding errors of both, so that a false identity is found out, and
//! * the bound of its rounding error is at most [`MAX_LOSS`] times that of the baseline.
//!
//! Operations that are exact at the numbers of a state count as such on both sides: a formula that keeps differences of close numbers until they are
//! exact is not replaced by one that rounds first. A result that is exact as a whole may be replaced by one that is rounded.
//!
//! **Angles.** The argument of a sine or cosine is known to half an ulp of each coordinate and parameter in it: the error of the baseline holds
//! what such a change of the angles does. So the sine of a difference may be computed from the sines of the angles, as if these had been
//! rounded before; a difference itself, or a power of it, may not.

mod bounded;
mod states;

use std::collections::BTreeMap;

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::{Map, Set};
use crate::expr::input::Input;
use crate::optimise::plan::{Op, Plan};
use bounded::Bounded;
use states::{STATES, state};

/// How much larger than that of the baseline the bound of an error may be. Sines of differences from those of the angles need 6.4, where all
/// angles are nearly equal; with 4, every chain of links would compute the sines of all differences.
const MAX_LOSS: f64 = 8.0;

/// Arguments of sines are read as angles through so many nested sums.
const MAX_DEPTH: usize = 24;

/// The states, and the results of the baseline at each of them.
pub(crate) struct Guard {
    positions: Map<Input, usize>,
    states: Vec<(Vec<f64>, Vec<Bounded>)>,
}

impl Guard {
    /// The guard of these results, as they stand in the graph.
    pub(crate) fn of(graph: &Graph, results: &[ExprId]) -> Self {
        let order = graph.reachable(results);
        let inputs: Vec<Input> = order
            .iter()
            .filter_map(|id| match graph.node(*id) {
                Node::Input(input) => Some(input.clone()),
                _ => None,
            })
            .collect();
        let positions: Map<Input, usize> = inputs
            .iter()
            .enumerate()
            .map(|(position, input)| (input.clone(), position))
            .collect();
        let in_order: Set<ExprId> = order
            .iter()
            .copied()
            .filter(|id| graph.keeps_order(*id))
            .collect();
        let states = (0..STATES).map(|number| {
            let numbers = state(&inputs, number);
            let known = baseline(graph, &order, &in_order, &positions, &numbers);
            let at = |id: &ExprId| known[id.index()];
            (numbers, results.iter().map(at).collect())
        });
        Self {
            states: states.collect(),
            positions,
        }
    }

    /// Whether a plan computes the results well enough; `roots` are the expressions that stand for them in the plan.
    pub(crate) fn accepts(&self, plan: &Plan, roots: &[ExprId]) -> bool {
        let places: Option<Vec<(usize, bool)>> = roots
            .iter()
            .map(|root| {
                let value = plan.value(*root)?;
                Some((value.op.index(), value.negative))
            })
            .collect();
        let Some(places) = places else { return false };
        self.states.iter().all(|(numbers, wanted)| {
            let known = self.evaluate(plan, numbers);
            let mut both = places.iter().zip(wanted);
            both.all(|((op, negative), wanted)| {
                let found = known[*op];
                is_no_worse(if *negative { found.negated() } else { found }, *wanted)
            })
        })
    }

    fn evaluate(&self, plan: &Plan, numbers: &[f64]) -> Vec<Bounded> {
        let mut known: Vec<Bounded> = Vec::with_capacity(plan.len());
        for id in plan.ids() {
            let op = |x: &crate::optimise::plan::OpId| known[x.index()];
            let result = match plan.op(id) {
                Op::Constant(value) => Bounded::exact(value.to_f64()),
                Op::Input(input) => {
                    let number = self.positions.get(input).map(|at| numbers[*at]);
                    Bounded::exact(number.unwrap_or(f64::NAN))
                }
                Op::Add(a, b) => op(a).plus(op(b)),
                Op::Subtract(a, b) => op(a).plus(op(b).negated()),
                Op::Multiply(a, b) => {
                    let exact = |x| match plan.op(x) {
                        Op::Constant(value) => value.is_power_of_two(),
                        _ => false,
                    };
                    match (exact(*a), exact(*b)) {
                        (true, _) => op(b).scaled(op(a).value, true),
                        (_, true) => op(a).scaled(op(b).value, true),
                        _ => op(a).times(op(b)),
                    }
                }
                Op::Divide(a, b) => op(a).over(op(b)),
                Op::Negate(a) => op(a).negated(),
                Op::IntegerPower(a, n) => integer_power(op(a), *n),
                Op::Power(a, b) => op(a).power(op(b)),
                Op::Call(function, arguments) => {
                    let arguments: Vec<Bounded> = arguments.iter().map(op).collect();
                    Bounded::call(*function, &arguments)
                }
                Op::Select {
                    comparison,
                    left,
                    right,
                    then,
                    otherwise,
                } => Bounded::select(*comparison, [op(left), op(right), op(then), op(otherwise)]),
                // The summand stands for the sum.
                Op::Loop { body, .. } => op(body),
            };
            known.push(result);
        }
        known
    }
}

/// Whether a result is as good as that of the baseline; where the baseline has no value, anything is.
fn is_no_worse(found: Bounded, wanted: Bounded) -> bool {
    if !(wanted.value.is_finite() && wanted.error.is_finite()) {
        return true;
    }
    const UNIT: f64 = f64::EPSILON / 2.0;
    // First-order bounds, and numbers below the smallest normal one.
    let apart = (found.value - wanted.value).abs();
    let near = apart <= 2.0 * UNIT * (found.error + wanted.error) + f64::MIN_POSITIVE;
    // A result that is exact by chance is no better than a rounded one.
    let allowed = wanted.error.max(wanted.value.abs());
    near && found.error <= MAX_LOSS * allowed + f64::MIN_POSITIVE
}

fn integer_power(base: Bounded, exponent: i32) -> Bounded {
    let size = exponent.unsigned_abs();
    let power = match size {
        0 => Bounded::exact(1.0),
        size => base.to_the(size),
    };
    match exponent < 0 {
        true => Bounded::exact(1.0).over(power),
        false => power,
    }
}

/// The values of all nodes, in the order in which they stand; `in_order`: the sums that keep it.
fn baseline(
    graph: &Graph,
    order: &[ExprId],
    in_order: &Set<ExprId>,
    positions: &Map<Input, usize>,
    numbers: &[f64],
) -> Vec<Bounded> {
    let length = order.last().map_or(0, |last| last.index() + 1);
    let mut known = vec![Bounded::exact(f64::NAN); length];
    for id in order {
        let of = |x: ExprId| known[x.index()];
        let result = match graph.node(*id) {
            Node::Constant(value) => Bounded::exact(value.to_f64()),
            Node::Input(input) => {
                let number = positions.get(input).map(|at| numbers[*at]);
                Bounded::exact(number.unwrap_or(f64::NAN))
            }
            Node::Sum { constant, terms } => {
                let terms = terms.iter();
                let term = |(c, x): &(Constant, ExprId)| {
                    (*x, of(*x).scaled(c.to_f64(), c.is_power_of_two()))
                };
                let total = match in_order.contains(id) {
                    true => by_groups(graph, terms.map(term)),
                    false => terms.map(|one| term(one).1).reduce(Bounded::plus),
                };
                let number = (!constant.is_zero()).then(|| Bounded::exact(constant.to_f64()));
                let all = total.into_iter().chain(number).reduce(Bounded::plus);
                all.unwrap_or(Bounded::exact(0.0))
            }
            Node::Product(factors) => product(factors, &of),
            Node::Power { base, exponent } => of(*base).power(of(*exponent)),
            Node::Call {
                function,
                arguments,
            } => {
                let mut values: Vec<Bounded> = arguments.iter().map(|x| of(*x)).collect();
                if matches!(function, Function::Sin | Function::Cos)
                    && let Some(value) = values.first_mut()
                    && let Some(size) = angle_size(graph, arguments[0], &of, MAX_DEPTH)
                {
                    value.error += size;
                }
                Bounded::call(*function, &values)
            }
            Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let operands = [*left, *right, *then, *otherwise].map(of);
                Bounded::select(*comparison, operands)
            }
            // The summand stands for the sum.
            Node::Loop { body, .. } => of(*body),
        };
        known[id.index()] = result;
    }
    known
}

/// A sum in the order in which it stands, groups of terms first.
fn by_groups(graph: &Graph, terms: impl Iterator<Item = (ExprId, Bounded)>) -> Option<Bounded> {
    let mut sums: BTreeMap<usize, Bounded> = BTreeMap::new();
    for (x, term) in terms {
        let sum = sums.entry(graph.group_of_term(x));
        sum.and_modify(|sum| *sum = sum.plus(term)).or_insert(term);
    }
    sums.into_values().reduce(Bounded::plus)
}

fn product(factors: &[(ExprId, i32)], of: &dyn Fn(ExprId) -> Bounded) -> Bounded {
    let all = |above: bool| {
        let side = factors.iter().filter(|(_, n)| (*n > 0) == above);
        side.map(|(x, n)| of(*x).to_the(n.unsigned_abs()))
            .reduce(Bounded::times)
    };
    match (all(true), all(false)) {
        (Some(above), Some(below)) => above.over(below),
        (Some(above), None) => above,
        (None, Some(below)) => Bounded::exact(1.0).over(below),
        (None, None) => Bounded::exact(1.0),
    }
}

/// Σ |part| of an angle; nothing where the argument is none.
fn angle_size(
    graph: &Graph,
    id: ExprId,
    of: &dyn Fn(ExprId) -> Bounded,
    depth: usize,
) -> Option<f64> {
    let depth = depth.checked_sub(1)?;
    match graph.node(id) {
        Node::Input(
            Input::Coordinate(_)
            | Input::Control(_)
            | Input::Parameter(_)
            | Input::ParameterElement(..)
            | Input::Time,
        ) => Some(of(id).value.abs()),
        Node::Sum { constant, terms } => {
            let mut size = constant.to_f64().abs();
            for (c, x) in terms {
                size += c.to_f64().abs() * angle_size(graph, *x, of, depth)?;
            }
            Some(size)
        }
        _ => None,
    }
}
