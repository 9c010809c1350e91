//! Sines and cosines of sums of angles computed from those of their parts, where that is cheaper.
//!
//! ```text
//! sin(a ± b) = sin a cos b ± cos a sin b        sin 2a = 2 sin a cos a
//! cos(a ± b) = cos a cos b ∓ sin a sin b        cos 2a = 1 − 2 sin² a
//! ```
//!
//! A sine with its cosine costs as much as about twenty-five products; a sum of angles costs four products and two
//! sums. So in a chain of n links, the n(n − 1)/2 differences of angles follow from n pairs. Which angles are computed,
//! and which follow from others, is decided for all results of a program together (`plan.rs` beside this file); the
//! change is dropped if the arranged program would cost more.
//!
//! **When it runs.** After all derivatives have been taken, and before common factors are extracted and operations are
//! arranged. The derivatives, the structure and the printed model are not affected, and the interpreter and the emitted
//! code run the same program.
//!
//! **What counts as an angle.** A sum of coordinates, parameters and the time with small integer coefficients, and of a
//! constant. Anything else (x/2, 1000 t, a product, a velocity, a value that varies with the index of a loop) is left
//! unchanged. In loops nothing would be gained: the pair of `q[j]` would be computed as often as that of `q[i] - q[j]`,
//! because programs have no arrays for intermediate results.
//!
//! **Rounding.** A sine computed by products has an absolute error of about 2⁻⁵² for each step, whereas the sine of a
//! rounded difference has a relative one. Angles are known only up to an absolute error, so that no significant digits
//! are lost; but the sine of a difference of equal angles is a number of that size and need not be exactly zero.

mod choice;
#[cfg(test)]
mod tests;

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;
use crate::expr::ordered::SortedMap;
use crate::expr::rewrite::Mapping;
use crate::optimise::binarize::arrange;
use choice::{Angle, Choice, How, Need, canonical, choose};

/// The larger Σ |n|, the more steps are needed; beyond this limit an angle is left unchanged.
const LARGEST: u64 = 8;

/// The largest number of nodes examined in an argument.
const MAX_STEPS: usize = 24;

/// The roots with sines and cosines of sums expanded where that pays.
pub(crate) fn expand_angles(graph: &mut Graph, roots: Vec<ExprId>) -> Vec<ExprId> {
    let nodes = graph.reachable(&roots);
    let mut wanted: SortedMap<Angle, Need> = SortedMap::new();
    let mut calls: SortedMap<ExprId, Occurrence> = SortedMap::new();
    // How an angle was written where it was written first: another order of its terms would round differently.
    let mut written: SortedMap<Angle, (ExprId, bool)> = SortedMap::new();
    for id in &nodes {
        let Node::Call {
            function: function @ (Function::Sin | Function::Cos),
            arguments,
        } = graph.node(*id)
        else {
            continue;
        };
        let function = *function;
        let [argument] = arguments[..] else { continue };
        let Some((angle, negative)) = read(graph, argument) else {
            continue;
        };
        let need = wanted.get_or_default(angle.clone());
        match function {
            Function::Sin => need.sine = true,
            _ => need.cosine = true,
        }
        written.get_or_insert(angle.clone(), (argument, negative));
        calls.insert(
            *id,
            Occurrence {
                angle,
                negative,
                function,
            },
        );
    }
    let is_number = |x: ExprId| graph.as_constant(x).is_some();
    let choice = choose(&wanted, &is_number);
    if choice.follows_nothing() {
        return roots;
    }
    let known = pairs(graph, &choice, &written);
    let mut mapping = Mapping::default();
    for old in nodes {
        let new = match calls.get(&old).and_then(|call| call.value(graph, &known)) {
            Some(value) => value,
            None => {
                if mapping.keeps(graph.node(old)) {
                    continue;
                }
                let node = graph.node(old).clone();
                graph.remake(&node, &mapping)
            }
        };
        mapping.set(old, new);
    }
    let expanded: Vec<ExprId> = roots.iter().map(|root| mapping.of(*root)).collect();
    let cost = |roots: &[ExprId]| arrange(graph, roots).cost();
    if cost(&expanded) < cost(&roots) {
        expanded
    } else {
        roots
    }
}

/// A sine or cosine in the expressions, of an angle or of its opposite.
struct Occurrence {
    angle: Angle,
    negative: bool,
    function: Function,
}

impl Occurrence {
    fn value(
        &self,
        graph: &mut Graph,
        known: &SortedMap<Angle, (ExprId, ExprId)>,
    ) -> Option<ExprId> {
        let (sine, cosine) = *known.get(&self.angle)?;
        Some(match (self.function, self.negative) {
            (Function::Sin, true) => graph.negate(sine),
            (Function::Sin, false) => sine,
            _ => cosine,
        })
    }
}

/// The argument as an angle, and whether it is the opposite of that angle.
fn read(graph: &mut Graph, argument: ExprId) -> Option<(Angle, bool)> {
    if graph.loops_of(argument) != 0 {
        return None;
    }
    let mut parts: SortedMap<ExprId, i64> = SortedMap::new();
    let mut constant = Constant::ZERO;
    let mut waiting = vec![(Constant::ONE, argument)];
    let mut steps = 0;
    while let Some((factor, x)) = waiting.pop() {
        steps += 1;
        if steps > MAX_STEPS {
            return None;
        }
        match graph.node(x) {
            Node::Input(
                Input::Coordinate(_)
                | Input::Parameter(_)
                | Input::ParameterElement(..)
                | Input::Control(_)
                | Input::Time,
            ) => {
                let part = parts.get_or_default(x);
                *part = part.checked_add(factor.as_integer()?)?;
            }
            Node::Sum {
                constant: own,
                terms,
            } => {
                constant = constant + factor * *own;
                waiting.extend(terms.iter().map(|(c, y)| (factor * *c, *y)));
            }
            _ => return None,
        }
    }
    parts.retain(|_, n| *n != 0);
    if parts.is_empty() {
        return None;
    }
    if !constant.is_zero() {
        let sign = if constant.is_negative() { -1 } else { 1 };
        parts.insert(graph.constant(constant.abs()), sign);
    }
    let size = parts
        .values()
        .fold(0, |size: u64, n| size.saturating_add(n.unsigned_abs()));
    if size > LARGEST {
        return None;
    }
    Some(canonical(parts.into_iter().collect()))
}

/// Sine and cosine of each angle of the choice.
fn pairs(
    graph: &mut Graph,
    choice: &Choice,
    written: &SortedMap<Angle, (ExprId, bool)>,
) -> SortedMap<Angle, (ExprId, ExprId)> {
    let mut known: SortedMap<Angle, (ExprId, ExprId)> = SortedMap::new();
    for (angle, how) in choice.steps() {
        let pair = match how {
            How::Direct => match written.get(angle) {
                Some((argument, negative)) => {
                    let sine = graph.call(Function::Sin, &[*argument]);
                    let sine = if *negative { graph.negate(sine) } else { sine };
                    Some((sine, graph.call(Function::Cos, &[*argument])))
                }
                None => {
                    let terms: Vec<(Constant, ExprId)> = angle
                        .iter()
                        .map(|(x, n)| (Constant::integer(*n), *x))
                        .collect();
                    let argument = graph.linear(Constant::ZERO, &terms);
                    let sine = graph.call(Function::Sin, &[argument]);
                    Some((sine, graph.call(Function::Cos, &[argument])))
                }
            },
            How::Double(half) => known.get(half).copied().map(|half| double(graph, half)),
            How::Sum {
                first,
                second,
                negative,
            } => known
                .get(first)
                .copied()
                .zip(known.get(second).copied())
                .map(|(a, b)| sum(graph, a, b, *negative)),
        };
        if let Some(pair) = pair {
            known.insert(angle.clone(), pair);
        }
    }
    known
}

/// Sine and cosine of a + b, or of a − b.
fn sum(
    graph: &mut Graph,
    (sine_a, cosine_a): (ExprId, ExprId),
    (sine_b, cosine_b): (ExprId, ExprId),
    negative: bool,
) -> (ExprId, ExprId) {
    let sign = if negative {
        Constant::MINUS_ONE
    } else {
        Constant::ONE
    };
    let mut product = |a, b| graph.multiply(a, b);
    let (sc, cs) = (product(sine_a, cosine_b), product(cosine_a, sine_b));
    let (cc, ss) = (product(cosine_a, cosine_b), product(sine_a, sine_b));
    let sine = graph.linear(Constant::ZERO, &[(Constant::ONE, sc), (sign, cs)]);
    let cosine = graph.linear(Constant::ZERO, &[(Constant::ONE, cc), (-sign, ss)]);
    (sine, cosine)
}

/// Sine and cosine of 2a.
fn double(graph: &mut Graph, (sine, cosine): (ExprId, ExprId)) -> (ExprId, ExprId) {
    let two = Constant::integer(2);
    let product = graph.multiply(sine, cosine);
    let square = graph.multiply(sine, sine);
    (
        graph.scale(two, product),
        graph.linear(Constant::ONE, &[(-two, square)]),
    )
}
