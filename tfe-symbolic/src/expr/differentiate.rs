//! Derivatives over the arena, forward along one direction and backward to all leaves at once.
//!
//! Both use an explicit stack or a forward loop and remember the nodes that they have visited, so that a shared node is
//! differentiated once.

use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::{Map, Set};
use crate::expr::input::Input;

/// Derivative of `of` by one leaf; other leaves, and the same array with another index, are held fixed.
pub fn derivative(graph: &mut Graph, of: ExprId, by: &Input) -> ExprId {
    directional(graph, of, &mut |graph, input| {
        (input == by).then(|| graph.constant(Constant::ONE))
    })
}

/// Derivative of `of` along the direction in which each leaf changes at the rate that `seed` gives (`None`: not at all).
///
/// With the velocity as the rate of each coordinate this is the total time derivative. Sums over ranges are differentiated by their bodies;
/// a rate may then mention the loop variables that its leaf mentions.
pub fn directional(
    graph: &mut Graph,
    of: ExprId,
    seed: &mut dyn FnMut(&mut Graph, &Input) -> Option<ExprId>,
) -> ExprId {
    Forward::default().derivative(graph, of, seed)
}

/// Forward derivatives of several expressions along one direction, each shared node once.
#[derive(Default)]
pub(crate) struct Forward(Map<ExprId, Option<ExprId>>);

impl Forward {
    /// The derivative of `of`; `seed` must be the same in every call.
    pub(crate) fn derivative(
        &mut self,
        graph: &mut Graph,
        of: ExprId,
        seed: &mut dyn FnMut(&mut Graph, &Input) -> Option<ExprId>,
    ) -> ExprId {
        let mut stack = vec![of];
        while let Some(&id) = stack.last() {
            if self.0.contains_key(&id) {
                stack.pop();
                continue;
            }
            let node = graph.node(id).clone();
            let before = stack.len();
            stack.extend(
                node.children()
                    .into_iter()
                    .filter(|child| !self.0.contains_key(child)),
            );
            if stack.len() == before {
                let rate = match &node {
                    Node::Input(input) => seed(graph, input),
                    node => self.rate(graph, id, node),
                };
                let rate =
                    rate.filter(|rate| !graph.as_constant(*rate).is_some_and(Constant::is_zero));
                self.0.insert(id, rate);
                stack.pop();
            }
        }
        self.of(of)
            .unwrap_or_else(|| graph.constant(Constant::ZERO))
    }

    fn of(&self, id: ExprId) -> Option<ExprId> {
        self.0.get(&id).copied().flatten()
    }

    /// The derivative of a node whose children are done; `None` stands for zero.
    fn rate(&self, graph: &mut Graph, id: ExprId, node: &Node) -> Option<ExprId> {
        match node {
            Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let (a, b) = (self.of(*then), self.of(*otherwise));
                self.chosen(graph, (*comparison, *left, *right), a, b)
            }
            Node::Call {
                function: function @ (Function::Min | Function::Max),
                arguments,
            } => {
                let [x, y] = arguments[..] else { return None };
                let (a, b) = (self.of(x), self.of(y));
                self.chosen(graph, (function.takes_first(), x, y), a, b)
            }
            Node::Call {
                function: Function::Hypot,
                arguments,
            } if arguments.iter().all(|x| self.of(*x).is_some()) => {
                Some(self.rate_of_hypot(graph, id, arguments))
            }
            Node::Loop { range, body } => {
                let body = self.of(*body)?;
                Some(graph.sum(range.clone(), body))
            }
            node => {
                let children = node.children();
                let mut terms = Vec::new();
                for (at, child) in children.iter().enumerate() {
                    if let Some(rate) = self.of(*child) {
                        let (coefficient, slope) = partial(graph, id, node, at);
                        terms.push((coefficient, graph.multiply(slope, rate)));
                    }
                }
                (!terms.is_empty()).then(|| graph.linear(Constant::ZERO, &terms))
            }
        }
    }

    /// (x ẋ + y ẏ)/h of h = hypot(x, y): one quotient, as of √(x² + y²), so that powers of h beside it are divided by it.
    fn rate_of_hypot(&self, graph: &mut Graph, h: ExprId, arguments: &[ExprId]) -> ExprId {
        let mut terms = Vec::with_capacity(arguments.len());
        for x in arguments {
            if let Some(rate) = self.of(*x) {
                terms.push((Constant::ONE, graph.multiply(*x, rate)));
            }
        }
        let above = graph.linear(Constant::ZERO, &terms);
        graph.divide(above, h)
    }

    fn chosen(
        &self,
        graph: &mut Graph,
        (comparison, left, right): (Comparison, ExprId, ExprId),
        then: Option<ExprId>,
        otherwise: Option<ExprId>,
    ) -> Option<ExprId> {
        then.or(otherwise)?;
        let zero = graph.constant(Constant::ZERO);
        Some(graph.select(
            comparison,
            left,
            right,
            then.unwrap_or(zero),
            otherwise.unwrap_or(zero),
        ))
    }
}

/// Derivatives of an expression by some of its nodes, in one backward sweep. Sums over ranges are not entered: they count as leaves.
///
/// Choices are differentiated forward: the derivative of a choice is the derivative of one branch. In a backward sweep,
/// the adjoint of the other branch is zero and would be multiplied by its derivatives, which may be infinite.
pub(crate) fn gradient(graph: &mut Graph, of: ExprId, by: &[ExprId]) -> Vec<ExprId> {
    let order = graph.reachable_outside_sums(&[of]);
    let mut results: Map<ExprId, ExprId> = Map::default();
    // A node that depends on no requested node needs no adjoint.
    let mut active: Set<ExprId> = by.iter().copied().collect();
    for id in &order {
        if outside_sums(graph.node(*id))
            .iter()
            .any(|child| active.contains(child))
        {
            active.insert(*id);
        }
    }
    let mut contributions: Map<ExprId, Vec<(Constant, ExprId)>> = Map::default();
    let one = graph.constant(Constant::ONE);
    contributions.insert(of, vec![(Constant::ONE, one)]);
    let mut choices: Vec<(ExprId, ExprId)> = Vec::new();
    for id in order.into_iter().rev().filter(|id| active.contains(id)) {
        let Some(terms) = contributions.remove(&id) else {
            continue;
        };
        let adjoint = graph.linear(Constant::ZERO, &terms);
        results.insert(id, adjoint);
        let node = graph.node(id).clone();
        if chooses(&node) {
            choices.push((adjoint, id));
            continue;
        }
        for (at, child) in outside_sums(&node).into_iter().enumerate() {
            if active.contains(&child) {
                let (coefficient, slope) = partial(graph, id, &node, at);
                let product = graph.multiply(adjoint, slope);
                contributions
                    .entry(child)
                    .or_default()
                    .push((coefficient, product));
            }
        }
    }
    let zero = graph.constant(Constant::ZERO);
    let mut by_leaf = Vec::with_capacity(by.len());
    for leaf in by {
        let outside = results.get(leaf).copied().unwrap_or(zero);
        by_leaf.push(match choices.is_empty() {
            true => outside,
            false => {
                let through = through_choices(graph, &choices, *leaf);
                graph.add(outside, through)
            }
        });
    }
    by_leaf
}

/// Whether its value is that of one of its children.
fn chooses(node: &Node) -> bool {
    match node {
        Node::Select { .. } => true,
        Node::Call { function, .. } => matches!(function, Function::Min | Function::Max),
        _ => false,
    }
}

/// Σ adjoint · ∂choice/∂leaf
fn through_choices(graph: &mut Graph, choices: &[(ExprId, ExprId)], leaf: ExprId) -> ExprId {
    let one = graph.constant(Constant::ONE);
    let mut known = Forward::default();
    // A leaf may be a sum over a range; nodes inside other sums do not count.
    let ids: Vec<ExprId> = choices.iter().map(|(_, choice)| *choice).collect();
    for id in graph.reachable_outside_sums(&ids) {
        if matches!(graph.node(id), Node::Loop { .. }) {
            known.0.insert(id, None);
        }
    }
    known.0.insert(leaf, Some(one));
    let mut terms = Vec::with_capacity(choices.len());
    for (adjoint, choice) in choices {
        let slope = known.derivative(graph, *choice, &mut |_, _| None);
        terms.push((Constant::ONE, graph.multiply(*adjoint, slope)));
    }
    graph.linear(Constant::ZERO, &terms)
}

fn outside_sums(node: &Node) -> Vec<ExprId> {
    if matches!(node, Node::Loop { .. }) {
        Vec::new()
    } else {
        node.children()
    }
}

/// c and s with ∂node/∂child = c s, for the child with this index.
fn partial(graph: &mut Graph, id: ExprId, node: &Node, at: usize) -> (Constant, ExprId) {
    let one = graph.constant(Constant::ONE);
    let slope = match node {
        Node::Constant(_) | Node::Input(_) => graph.constant(Constant::ZERO),
        Node::Sum { terms, .. } => return (terms.get(at).map_or(Constant::ZERO, |(c, _)| *c), one),
        Node::Product(factors) => {
            let mut rest = factors.clone();
            let Some((_, exponent)) = rest.get_mut(at) else {
                return (Constant::ZERO, one);
            };
            let coefficient = Constant::integer(i64::from(*exponent));
            match exponent.checked_sub(1) {
                Some(less) => *exponent = less,
                // x^(i32::MIN): one more division instead.
                None => {
                    let (x, _) = factors[at];
                    return (coefficient, graph.divide(id, x));
                }
            }
            return (coefficient, graph.product(Constant::ONE, &rest));
        }
        Node::Power { base, exponent } if at == 0 => {
            let less = graph.subtract(*exponent, one);
            let power = graph.power(*base, less);
            graph.multiply(*exponent, power)
        }
        Node::Power { base, .. } => {
            let logarithm = graph.call(Function::Ln, &[*base]);
            let slope = graph.multiply(logarithm, id);
            if graph.as_constant(logarithm).is_some() {
                // A power of a positive number is smooth everywhere.
                return (Constant::ONE, slope);
            }
            // Where the power vanishes its logarithm is infinite, and the slope zero: a contact `max(-x, 0)^e` that is open.
            let zero = graph.constant(Constant::ZERO);
            let size = graph.call(Function::Abs, &[id]);
            graph.select(Comparison::LessOrEqual, size, zero, zero, slope)
        }
        Node::Call {
            function,
            arguments,
        } => function.derivative(graph, arguments, at),
        Node::Select {
            comparison,
            left,
            right,
            ..
        } => {
            let zero = graph.constant(Constant::ZERO);
            match at {
                2 => graph.select(*comparison, *left, *right, one, zero),
                3 => graph.select(*comparison, *left, *right, zero, one),
                _ => zero,
            }
        }
        // Only a forward sweep meets sums over ranges.
        Node::Loop { .. } => graph.constant(Constant::ZERO),
    };
    (Constant::ONE, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::graph::SumRange;
    use crate::expr::input::{Affine, IndexSymbol, LoopVariable};

    fn q(index: i64) -> Input {
        Input::Coordinate(Affine::constant(index))
    }

    #[test]
    fn no_sweep_multiplies_the_branch_that_is_not_chosen() {
        // f = y (√x if x > 0 else 0); ∂√x/∂x is infinite at x = 0
        let mut g = Graph::default();
        let (x, y, zero) = (g.input(q(0)), g.input(q(1)), g.constant(Constant::ZERO));
        let root = g.call(Function::Sqrt, &[x]);
        let chosen = g.select(Comparison::Less, zero, x, root, zero);
        let f = g.multiply(y, chosen);
        let forward = [0, 1].map(|at| derivative(&mut g, f, &q(at)));
        assert_eq!(gradient(&mut g, f, &[x, y]), forward);
        assert_eq!(
            g.display(forward[0]).to_string(),
            "q[1]*select(0 < q[0], 0.5*(sqrt(q[0])^(-1)), 0)"
        );
    }

    #[test]
    fn forward_and_backward_agree() {
        // f = x² sin y + x / y
        let mut g = Graph::default();
        let (x, y) = (g.input(q(0)), g.input(q(1)));
        let (x2, sine) = (g.multiply(x, x), g.call(Function::Sin, &[y]));
        let (a, b) = (g.multiply(x2, sine), g.divide(x, y));
        let f = g.add(a, b);
        let unused = g.input(q(2));
        let backward = gradient(&mut g, f, &[x, y, unused]);
        for (at, backward) in backward.into_iter().enumerate() {
            let forward = derivative(&mut g, f, &q(at as i64));
            assert_eq!(
                forward,
                backward,
                "{} / {}",
                g.display(forward),
                g.display(backward)
            );
        }
    }

    #[test]
    fn the_body_of_a_sum_is_differentiated() {
        let mut g = Graph::default();
        let index = Affine::symbol(IndexSymbol::Loop(LoopVariable(0)));
        let element = g.input(Input::Coordinate(index));
        let square = g.multiply(element, element);
        let n = Affine::symbol(IndexSymbol::Field("n".to_owned()));
        let range = SumRange {
            variable: LoopVariable(0),
            start: Affine::constant(0),
            end: n,
        };
        let sum = g.sum(range, square);
        let rate = directional(&mut g, sum, &mut |graph, input| match input {
            Input::Coordinate(index) => Some(graph.input(Input::Velocity(index.clone()))),
            _ => None,
        });
        assert_eq!(g.display(rate).to_string(), "2*sum(i in 0..n, q[i]*v[i])");
    }

    #[test]
    fn kinks_are_differentiated_by_branches() {
        let mut g = Graph::default();
        let (x, y) = (g.input(q(0)), g.input(q(1)));
        let x2 = g.multiply(x, x);
        let smaller = g.call(Function::Min, &[x2, y]);
        let slope = derivative(&mut g, smaller, &q(0));
        assert_eq!(
            g.display(slope).to_string(),
            "select(q[0]^2 <= q[1], 2*q[0], 0)"
        );
    }

    #[test]
    fn deep_expressions_do_not_overflow_the_stack() {
        let mut g = Graph::default();
        let x = g.input(q(0));
        let mut f = x;
        for _ in 0..50_000 {
            f = g.call(Function::Sin, &[f]);
        }
        let slope = derivative(&mut g, f, &q(0));
        assert!(g.reachable(&[slope]).len() > 50_000);
        assert_ne!(gradient(&mut g, f, &[x])[0], x);
    }
}
