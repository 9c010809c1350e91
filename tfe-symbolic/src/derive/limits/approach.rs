//! Limits of expressions as a leaf changes and quantities of it approach zero from one side.

use super::facts::{factors_of, is_zero};
use super::norm::MAX_DEPTH;
use crate::expr::constant::Constant;
use crate::expr::differentiate::derivative;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::input::Input;
use crate::expr::rewrite::Mapping;

/// How quantities approach zero as a leaf changes.
pub(super) struct Approach<'a> {
    leaf: &'a Input,
    /// What vanishes: the leaf itself, or expressions of it.
    zeros: &'a [ExprId],
    /// 1 from above, −1 from below, and 0 at zero itself.
    side: i64,
    /// The slopes found so far; `None` for those that vanish or are not known.
    slopes: Map<ExprId, Option<ExprId>>,
}

impl<'a> Approach<'a> {
    pub(super) fn of(leaf: &'a Input, zeros: &'a [ExprId], side: i64) -> Self {
        Self {
            leaf,
            zeros,
            side,
            slopes: Map::default(),
        }
    }

    /// The limit of an expression without jumps but those at zero; `None` where it is not known.
    pub(super) fn limit(&mut self, graph: &mut Graph, x: ExprId, depth: usize) -> Option<ExprId> {
        let depth = depth.checked_sub(1)?;
        let mut mapping = Mapping::default();
        for old in graph.reachable(&[x]) {
            let node = graph.node(old).clone();
            let new = match &node {
                _ if self.zeros.contains(&old) => graph.constant(Constant::ZERO),
                node if mapping.keeps(node) => continue,
                node => self.limit_of_node(graph, node, &mapping, depth)?,
            };
            mapping.set(old, new);
        }
        Some(mapping.of(x))
    }

    /// The same of a node, from the limits of its children.
    fn limit_of_node(
        &mut self,
        graph: &mut Graph,
        node: &Node,
        limits: &Mapping,
        depth: usize,
    ) -> Option<ExprId> {
        match node {
            Node::Call {
                function: Function::Sign,
                arguments,
            } if self.side != 0 => {
                let argument = *arguments.first()?;
                if is_zero(graph, limits.of(argument)) {
                    let slope = self.slope(graph, argument, depth)?;
                    let sign = graph.call(Function::Sign, &[slope]);
                    return Some(graph.scale(Constant::integer(self.side), sign));
                }
            }
            Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } if self.side != 0 && limits.of(*left) == limits.of(*right) => {
                let (then, otherwise) = (limits.of(*then), limits.of(*otherwise));
                if then == otherwise {
                    return Some(then);
                }
                let difference = graph.subtract(*left, *right);
                let slope = self.slope(graph, difference, depth)?;
                let change = Constant::integer(self.side) * graph.as_constant(slope)?;
                let holds = comparison.holds(change.to_f64(), 0.0);
                return Some(if holds { then } else { otherwise });
            }
            _ if is_singular(graph, node, limits) => return None,
            _ => {}
        }
        let new = graph.remake(node, limits);
        let new = powers_of_choices(graph, new);
        let is_number = |x: ExprId| graph.as_constant(x).is_some();
        let mut children = node.children().into_iter();
        let is_known = is_number(new) || !children.all(|child| is_number(limits.of(child)));
        is_known.then_some(new)
    }

    /// The limit of a derivative by the leaf, unless it vanishes.
    fn slope(&mut self, graph: &mut Graph, x: ExprId, depth: usize) -> Option<ExprId> {
        if let Some(known) = self.slopes.get(&x) {
            return *known;
        }
        let slope = derivative(graph, x, self.leaf);
        let limit = self.limit(graph, slope, depth);
        let limit = limit.filter(|limit| !is_zero(graph, *limit));
        self.slopes.insert(x, limit);
        limit
    }
}

/// A product with choices between the powers of two numbers for powers of choices: the same for { 1 where a ≤ 0; 0 elsewhere }² and
/// { −1 where a ≤ 0; 0 elsewhere }².
fn powers_of_choices(graph: &mut Graph, x: ExprId) -> ExprId {
    let mut factors = factors_of(graph, x);
    let mut is_changed = false;
    for (y, n) in &mut factors {
        let Node::Select {
            comparison,
            left,
            right,
            then,
            otherwise,
        } = *graph.node(*y)
        else {
            continue;
        };
        let branches = [then, otherwise].map(|branch| graph.as_constant(branch)?.powi(*n));
        if let ([Some(then), Some(otherwise)], true) = (branches, *n > 1) {
            let [then, otherwise] = [then, otherwise].map(|branch| graph.constant(branch));
            (*y, *n) = (graph.select(comparison, left, right, then, otherwise), 1);
            is_changed = true;
        }
    }
    let coefficient = graph.as_multiple(x).0;
    match is_changed {
        true => graph.product(coefficient, &factors),
        false => x,
    }
}

/// Whether the limit of a node does not follow from those of its children.
fn is_singular(graph: &Graph, node: &Node, limits: &Mapping) -> bool {
    let vanishes = |x: &ExprId| is_zero(graph, limits.of(*x));
    match node {
        Node::Product(factors) => {
            let diverges = |(y, n): &(ExprId, i32)| {
                (*n < 0 && vanishes(y)) || may_diverge(graph, limits.of(*y), MAX_DEPTH)
            };
            factors.iter().any(|(y, _)| vanishes(y)) && factors.iter().any(diverges)
        }
        Node::Power { base, exponent } => {
            let exponent = graph.as_constant(limits.of(*exponent));
            vanishes(base) && exponent.is_some_and(|e| e.is_zero() || e.is_negative())
        }
        Node::Call {
            function: Function::Atan2,
            arguments,
        } => arguments.iter().all(vanishes),
        _ => false,
    }
}

/// Whether there is a power of zero in it that is infinite for some values of parameters.
fn may_diverge(graph: &Graph, x: ExprId, depth: usize) -> bool {
    let Some(depth) = depth.checked_sub(1) else {
        return true;
    };
    match graph.node(x) {
        Node::Product(factors) => factors.iter().any(|(y, _)| may_diverge(graph, *y, depth)),
        Node::Sum { terms, .. } => terms.iter().any(|(_, y)| may_diverge(graph, *y, depth)),
        Node::Power { base, exponent } if is_zero(graph, *base) => {
            let (number, terms) = graph.terms(*exponent);
            number.is_negative() || terms.iter().any(|(c, _)| c.is_negative())
        }
        _ => false,
    }
}
