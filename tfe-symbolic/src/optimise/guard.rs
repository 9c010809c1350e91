//! The guard of digits: a rewritten formula may lose no more digits than the formula as declared, at states where
//! digits are easily lost.
//!
//! The baseline is the formula as declared, differentiated term by term and evaluated in the given order. A plan of
//! operations that
//! computes the same results is accepted if at each state
//!
//! * its results agree with those of the baseline within the rounding errors of both, so that a false identity is found out, and
//! * the bound of its rounding error is at most [`MAX_LOSS`] times that of the baseline, or [`MAX_LOSS_WITH_ANGLES`].
//!
//! Operations that are exact for the numbers of a state count as exact on both sides: a formula that keeps differences
//! of close numbers until they are exact is not replaced by one that rounds first. A result that is exact as a whole
//! may be replaced by one that is rounded.
//!
//! **Angles.** The argument of a sine or cosine is known only up to half an ulp of each coordinate and parameter in it:
//! the error of the baseline includes the effect of such a change of the angles. So the sine of a difference may be
//! computed from the sines of the angles, as if these had been rounded before; a difference itself, or a power of it,
//! may not. The cosine of equal angles counts as rounded, except at states where the velocities are equal or nearly so
//! as well: there v − w cos(a − b) is exact, and v − w (cos a cos b + sin a sin b) is not.
//!
//! **Choices.** Where there are choices, each state is evaluated twice: with the branches that its numbers choose, and
//! with the others.

mod bounded;
mod states;

use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::input::Input;
use crate::expr::sorting::sort_by_key;
use crate::optimise::plan::{Op, OpId, Plan};
use bounded::Bounded;
use states::{moves_together, number_of_states, state};

/// The largest accepted ratio of the error bound to that of the baseline. A product of two velocities and the cosine of
/// a difference needs 8 where that cosine is computed from those of equal angles; with 4, every chain of links would
/// compute the sines of all differences.
const MAX_LOSS_WITH_ANGLES: f64 = 8.0;

/// The same for formulas without angles.
const MAX_LOSS: f64 = 4.0;

/// Arguments of sines are read as angles through so many nested sums.
const MAX_DEPTH: usize = 24;

/// Arguments of more parts are not read: sums that stand in several others are read on every path through these.
const MAX_PARTS: usize = 4096;

/// The states, and the results of the baseline at each of them.
pub(crate) struct Guard {
    positions: Map<Input, usize>,
    states: Vec<State>,
    max_loss: f64,
}

/// A state and the results of the baseline.
struct State {
    numbers: Vec<f64>,
    branches: Branches,
    wanted: Vec<Bounded>,
}

/// Which branches of choices are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Branches {
    AsCompared,
    /// The others: few states are on each side of a choice, and what they have in common is beside it.
    Others,
}

impl Branches {
    fn choose(
        self,
        comparison: Comparison,
        [left, right, then, otherwise]: [Bounded; 4],
    ) -> Bounded {
        match comparison.holds(left.value, right.value) == (self == Self::AsCompared) {
            true => then,
            false => otherwise,
        }
    }
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
        let baseline = Baseline::of(graph, &order, &positions);
        let chooses = |id: &ExprId| matches!(graph.node(*id), Node::Select { .. });
        let branches: &[Branches] = match order.iter().any(chooses) {
            true => &[Branches::AsCompared, Branches::Others],
            false => &[Branches::AsCompared],
        };
        let mut states = Vec::new();
        let mut known = vec![Bounded::NOTHING; order.last().map_or(0, |last| last.index() + 1)];
        for number in 0..number_of_states(&inputs) {
            let numbers = state(&inputs, number);
            for branches in branches {
                let rounded = !moves_together(number);
                baseline.evaluate(&numbers, *branches, rounded, &mut known);
                states.push(State {
                    wanted: results.iter().map(|id| known[id.index()]).collect(),
                    numbers: numbers.clone(),
                    branches: *branches,
                });
            }
        }
        let is_sine = |id: &ExprId| {
            matches!(
                graph.node(*id),
                Node::Call {
                    function: Function::Sin | Function::Cos,
                    ..
                }
            )
        };
        let max_loss = match order.iter().any(is_sine) {
            true => MAX_LOSS_WITH_ANGLES,
            false => MAX_LOSS,
        };
        Self {
            positions,
            states,
            max_loss,
        }
    }

    /// Whether a plan computes the results accurately enough; `roots` are the expressions that represent them in the
    /// plan.
    pub(crate) fn accepts(&self, plan: &Plan, roots: &[ExprId]) -> bool {
        let places: Option<Vec<(usize, bool)>> = roots
            .iter()
            .map(|root| {
                let value = plan.value(*root)?;
                Some((value.op.index(), value.negative))
            })
            .collect();
        let Some(places) = places else { return false };
        let sources = self.sources(plan);
        let mut known = vec![Bounded::NOTHING; plan.len()];
        self.states.iter().all(|state| {
            evaluate(plan, &sources, state, &mut known);
            let mut both = places.iter().zip(&state.wanted);
            both.all(|((op, negative), wanted)| {
                let found = known[*op];
                is_no_worse(
                    if *negative { found.negated() } else { found },
                    *wanted,
                    self.max_loss,
                )
            })
        })
    }

    /// Where the operations of a plan have their values from.
    fn sources(&self, plan: &Plan) -> Vec<Source> {
        let source = |id| match plan.op(id) {
            Op::Constant(value) => Source::Constant {
                value: Bounded::exact(value.to_f64()),
                scales_exactly: value.is_power_of_two(),
            },
            Op::Input(input) => Source::Input(self.positions.get(input).copied()),
            _ => Source::Computed,
        };
        plan.ids().map(source).collect()
    }
}

/// Where an operation of a plan has its value from.
#[derive(Clone, Copy, Debug)]
enum Source {
    Constant {
        value: Bounded,
        scales_exactly: bool,
    },
    /// From the numbers of a state, where it stands among them.
    Input(Option<usize>),
    Computed,
}

/// The values of all operations of a plan at a state.
fn evaluate(plan: &Plan, sources: &[Source], state: &State, known: &mut [Bounded]) {
    for (id, source) in plan.ids().zip(sources) {
        let op = |x: &OpId| known[x.index()];
        let result = match source {
            Source::Constant { value, .. } => *value,
            Source::Input(at) => {
                at.map_or(Bounded::NOTHING, |at| Bounded::input(state.numbers[at]))
            }
            Source::Computed => match plan.op(id) {
                Op::Constant(_) | Op::Input(_) => Bounded::NOTHING,
                Op::Add(a, b) => op(a).plus(op(b)),
                Op::Subtract(a, b) => op(a).plus(op(b).negated()),
                Op::Multiply(a, b) => {
                    let exact = |x: &OpId| match sources[x.index()] {
                        Source::Constant { scales_exactly, .. } => scales_exactly,
                        _ => false,
                    };
                    match (exact(a), exact(b)) {
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
                } => {
                    let operands = [op(left), op(right), op(then), op(otherwise)];
                    state.branches.choose(*comparison, operands)
                }
                // The summand stands for the sum.
                Op::Loop { body, .. } => op(body),
            },
        };
        known[id.index()] = result;
    }
}

/// Whether a result is as accurate as that of the baseline; where the baseline is not defined, any result is accepted.
fn is_no_worse(found: Bounded, wanted: Bounded, max_loss: f64) -> bool {
    if !(wanted.value.is_finite() && wanted.error.is_finite()) {
        return true;
    }
    const UNIT: f64 = f64::EPSILON / 2.0;
    // An allowance for rounding errors of the bounds themselves.
    const ROUNDING: f64 = 1e-9;
    // First-order bounds, and numbers below the smallest normal one.
    let apart = (found.value - wanted.value).abs();
    let near = apart <= 2.0 * UNIT * (found.error + wanted.error) + f64::MIN_POSITIVE;
    // A result that happens to be exact counts as rounded.
    let allowed = wanted.error.max(wanted.value.abs());
    near && found.error <= max_loss * (1.0 + ROUNDING) * allowed + f64::MIN_POSITIVE
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

/// The formula as declared, made ready to be evaluated at many states.
struct Baseline<'a> {
    graph: &'a Graph,
    steps: Vec<(ExprId, Step)>,
}

/// How a node has its value.
enum Step {
    Constant(Bounded),
    /// Where it stands among the numbers of a state.
    Input(usize),
    /// In this order, groups of terms first.
    Sum {
        terms: Vec<Term>,
        number: Option<Bounded>,
    },
    Sine {
        function: Function,
        argument: ExprId,
        angle: Option<Angle>,
    },
    /// As the node says.
    Other,
}

/// A term of a sum.
struct Term {
    group: usize,
    x: ExprId,
    factor: f64,
    scales_exactly: bool,
}

/// The parts of an angle: a number, and inputs with their factors.
#[derive(Default)]
struct Angle {
    number: f64,
    parts: Vec<(ExprId, f64)>,
}

impl<'a> Baseline<'a> {
    fn of(graph: &'a Graph, order: &[ExprId], positions: &Map<Input, usize>) -> Self {
        let step = |id: &ExprId| {
            let step = match graph.node(*id) {
                Node::Constant(value) => Step::Constant(Bounded::exact(value.to_f64())),
                Node::Input(input) => positions
                    .get(input)
                    .map_or(Step::Other, |at| Step::Input(*at)),
                Node::Sum { constant, terms } => {
                    let keeps_order = graph.keeps_order(*id);
                    let term = |(c, x): &(Constant, ExprId)| Term {
                        group: if keeps_order {
                            graph.group_of_term(*x)
                        } else {
                            0
                        },
                        x: *x,
                        factor: c.to_f64(),
                        scales_exactly: c.is_power_of_two(),
                    };
                    let mut terms: Vec<Term> = terms.iter().map(term).collect();
                    sort_by_key(&mut terms, |term| term.group);
                    let number = (!constant.is_zero()).then(|| Bounded::exact(constant.to_f64()));
                    Step::Sum { terms, number }
                }
                Node::Call {
                    function: function @ (Function::Sin | Function::Cos),
                    arguments,
                } => {
                    let mut angle = Angle::default();
                    let is_one = angle.collect(graph, arguments[0], 1.0, MAX_DEPTH);
                    Step::Sine {
                        function: *function,
                        argument: arguments[0],
                        angle: is_one.then_some(angle),
                    }
                }
                _ => Step::Other,
            };
            (*id, step)
        };
        Self {
            graph,
            steps: order.iter().map(step).collect(),
        }
    }

    /// The values of all nodes at a state; `cos_zero_is_rounded`: whether the cosine of equal angles counts as rounded.
    fn evaluate(
        &self,
        numbers: &[f64],
        branches: Branches,
        cos_zero_is_rounded: bool,
        known: &mut [Bounded],
    ) {
        for (id, step) in &self.steps {
            let of = |x: ExprId| known[x.index()];
            let result = match step {
                Step::Constant(value) => *value,
                Step::Input(at) => Bounded::input(numbers[*at]),
                Step::Sum { terms, number } => sum(terms, *number, &of),
                Step::Sine {
                    function,
                    argument,
                    angle,
                } => {
                    let mut argument = of(*argument);
                    if let Some(angle) = angle {
                        argument.error += angle.size(&of);
                    }
                    let mut result = Bounded::call(*function, &[argument]);
                    if *function == Function::Cos && argument.value == 0.0 && cos_zero_is_rounded {
                        result.error += result.value.abs();
                    }
                    result
                }
                Step::Other => match self.graph.node(*id) {
                    Node::Constant(_) | Node::Input(_) | Node::Sum { .. } => Bounded::NOTHING,
                    Node::Product(factors) => product(factors, &of),
                    Node::Power { base, exponent } => of(*base).power(of(*exponent)),
                    Node::Call {
                        function,
                        arguments,
                    } => {
                        let values: Vec<Bounded> = arguments.iter().map(|x| of(*x)).collect();
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
                        branches.choose(*comparison, operands)
                    }
                    // The summand stands for the sum.
                    Node::Loop { body, .. } => of(*body),
                },
            };
            known[id.index()] = result;
        }
    }
}

/// The sum of the groups of terms, each of them added first, and a number.
fn sum(terms: &[Term], number: Option<Bounded>, of: &dyn Fn(ExprId) -> Bounded) -> Bounded {
    let mut total: Option<Bounded> = None;
    let mut own: Option<Bounded> = None;
    let plus = |sum: Option<Bounded>, other: Bounded| match sum {
        Some(sum) => Some(sum.plus(other)),
        None => Some(other),
    };
    for (at, term) in terms.iter().enumerate() {
        let value = of(term.x).scaled(term.factor, term.scales_exactly);
        own = plus(own, value);
        let is_last = terms
            .get(at + 1)
            .is_none_or(|next| next.group != term.group);
        if is_last && let Some(group) = own.take() {
            total = plus(total, group);
        }
    }
    if let Some(number) = number {
        total = plus(total, number);
    }
    total.unwrap_or(Bounded::exact(0.0))
}

fn product(factors: &[(ExprId, i32)], of: &dyn Fn(ExprId) -> Bounded) -> Bounded {
    let (mut above, mut below): (Option<Bounded>, Option<Bounded>) = (None, None);
    for (x, n) in factors {
        let power = of(*x).to_the(n.unsigned_abs());
        let side = if *n > 0 { &mut above } else { &mut below };
        *side = match *side {
            Some(known) => Some(known.times(power)),
            None => Some(power),
        };
    }
    match (above, below) {
        (above, Some(below)) => above.unwrap_or(Bounded::exact(1.0)).over(below),
        (above, None) => above.unwrap_or(Bounded::exact(1.0)),
    }
}

impl Angle {
    /// Adds the parts of an expression, so many times; whether it is an angle.
    fn collect(&mut self, graph: &Graph, id: ExprId, factor: f64, depth: usize) -> bool {
        let Some(depth) = depth.checked_sub(1) else {
            return false;
        };
        match graph.node(id) {
            Node::Input(
                Input::Coordinate(_)
                | Input::Control(_)
                | Input::Parameter(_)
                | Input::ParameterElement(..)
                | Input::Time,
            ) => {
                self.parts.push((id, factor));
                self.parts.len() <= MAX_PARTS
            }
            Node::Sum { constant, terms } => {
                self.number += factor * constant.to_f64().abs();
                terms
                    .iter()
                    .all(|(c, x)| self.collect(graph, *x, factor * c.to_f64().abs(), depth))
            }
            _ => false,
        }
    }

    /// Σ |part|
    fn size(&self, of: &dyn Fn(ExprId) -> Bounded) -> f64 {
        let part = |(x, factor): &(ExprId, f64)| factor * of(*x).value.abs();
        self.number + self.parts.iter().map(part).sum::<f64>()
    }
}
