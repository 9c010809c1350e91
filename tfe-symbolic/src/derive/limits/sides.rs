//! Limits of terms that jump where a quantity changes its sign, from both of its sides.
//!
//! ```text
//! |x| |sin x|          ∂²/∂x² = 2 cos x sign x sign(sin x) − |x sin x|  →  { 2  where |x| ≤ 0;  2 cos x sign x sign(sin x)  elsewhere } − |x sin x|
//! ```
//!
//! A sign is zero at zero, and a choice has the value of one of its branches: where two of them jump at the same place, their
//! product is there not what it is on both sides. The terms that jump are evaluated for a quantity u → 0 from above and from
//! below, where sign u is 1 and −1, and sign w(u) the sign of u ∂w/∂u. Where both are the same expression, and not what the terms
//! are at u = 0, that is the limit. Where they differ, as 2 sign x of x |x| + |x| |sin x| does, the terms are unchanged.

use super::facts::{factors_of, is_at_rest, is_zero, moves};
use super::norm::{MAX_DEPTH, MAX_SUMS, is_small_with_its_argument};
use crate::derive::entry::Entry;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::differentiate::derivative;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::input::{Affine, Input};
use crate::expr::rewrite::Mapping;

/// In a sum no more quantities than these are examined.
const MAX_KINKS: usize = 6;

/// Differences of the two sides are multiplied out to at most this number of terms.
const MAX_TERMS: usize = 64;

/// The list of the placeholder of the quantity that vanishes.
const KINK: u32 = 1;

/// Rewrites derivatives so that they have the limits that they have from both sides.
pub(super) fn take_limits_from_both_sides(graph: &mut Graph, derivatives: &mut [&mut Entry]) {
    let roots: Vec<ExprId> = derivatives.iter().map(|entry| entry.value).collect();
    let nodes = graph.reachable(&roots);
    if !nodes.iter().any(|id| is_jump(graph.node(*id))) {
        return;
    }
    let mut sides = Sides::default();
    for entry in derivatives {
        entry.value = sides.limit(graph, entry.value);
    }
}

/// What finds limits from both sides.
#[derive(Default)]
struct Sides {
    /// A copy in which limits are sought: most jumps have none, and expressions made in vain would change the order of later ones.
    trial: Option<Graph>,
    /// The expressions examined so far.
    known: Map<ExprId, ExprId>,
}

impl Sides {
    /// The expression with the limits that its jumping terms have together.
    fn limit(&mut self, graph: &mut Graph, x: ExprId) -> ExprId {
        if let Some(known) = self.known.get(&x) {
            return *known;
        }
        let new = self.new_limit(graph, x).unwrap_or(x);
        self.known.insert(x, new);
        new
    }

    fn new_limit(&mut self, graph: &mut Graph, x: ExprId) -> Option<ExprId> {
        if graph.contains_sum(x) {
            return None;
        }
        let (number, terms) = graph.terms(x);
        let (jumping, mut others): (Vec<_>, Vec<_>) = terms
            .into_iter()
            .partition(|(_, term)| jumps(graph, *term, MAX_SUMS) > 0);
        let mut times = jumping
            .iter()
            .map(|(_, term)| jumps(graph, *term, MAX_SUMS));
        if !times.any(|times| times > 1) {
            return None;
        }
        let trial = self.trial.get_or_insert_with(|| graph.clone());
        let sum = trial.linear(Constant::ZERO, &jumping);
        if limits_at_kinks(trial, sum).is_empty() {
            return None;
        }
        let sum = graph.linear(Constant::ZERO, &jumping);
        let zero = graph.constant(Constant::ZERO);
        let mut value = sum;
        for (kink, limit) in limits_at_kinks(graph, sum) {
            let size = graph.call(Function::Abs, &[kink]);
            value = graph.select(Comparison::LessOrEqual, size, zero, limit, value);
        }
        others.push((Constant::ONE, value));
        Some(graph.linear(number, &others))
    }
}

/// The number of jumps that are multiplied with each other in a term.
fn jumps(graph: &Graph, term: ExprId, depth: usize) -> usize {
    let mut count = 0_usize;
    for (y, n) in factors_of(graph, term) {
        let times = usize::try_from(n).unwrap_or(0);
        let own = match (graph.as_sum(y), depth.checked_sub(1)) {
            (Some((_, terms)), Some(depth)) => {
                let within = terms.iter().map(|(_, z)| jumps(graph, *z, depth));
                within.max().unwrap_or(0).saturating_mul(times)
            }
            _ => usize::from(times > 0 && is_jump(graph.node(y))),
        };
        count = count.saturating_add(own);
    }
    count
}

/// Whether it is a sign or a choice.
fn is_jump(node: &Node) -> bool {
    matches!(
        node,
        Node::Select { .. }
            | Node::Call {
                function: Function::Sign,
                ..
            }
    )
}

/// Quantities that may vanish, and the limits of a sum where they do, as far as it has these from both sides and is not
/// evaluated to them.
fn limits_at_kinks(graph: &mut Graph, sum: ExprId) -> Vec<(ExprId, ExprId)> {
    let mut kinks = Vec::new();
    for (_, term) in graph.terms(sum).1 {
        add_kinks(graph, term, MAX_SUMS, &mut kinks);
    }
    kinks.truncate(MAX_KINKS);
    let mut found = Vec::with_capacity(kinks.len());
    for kink in kinks {
        if let Some(limit) = limit_at(graph, sum, kink) {
            found.push((kink, limit));
        }
    }
    found
}

/// The quantities that decide the jumps in a term.
fn add_kinks(graph: &mut Graph, term: ExprId, depth: usize, kinks: &mut Vec<ExprId>) {
    for (y, n) in factors_of(graph, term) {
        if n <= 0 {
            continue;
        }
        match graph.node(y).clone() {
            Node::Call {
                function: Function::Sign,
                arguments,
            } => {
                for argument in arguments {
                    add_zeros(graph, argument, MAX_DEPTH, kinks);
                }
            }
            Node::Select { left, right, .. } => {
                let difference = graph.subtract(left, right);
                add_zeros(graph, difference, MAX_DEPTH, kinks);
            }
            Node::Sum { terms, .. } if depth > 0 => {
                for (_, z) in terms {
                    add_kinks(graph, z, depth - 1, kinks);
                }
            }
            _ => {}
        }
    }
}

/// The quantities with which an expression vanishes: x and y of tanh(x y). A sum that is not solved for an input may
/// vanish with one, as x + x³.
fn add_zeros(graph: &Graph, x: ExprId, depth: usize, kinks: &mut Vec<ExprId>) {
    let Some(depth) = depth.checked_sub(1) else {
        return;
    };
    let x = graph.as_multiple(x).1;
    match graph.node(x) {
        Node::Call {
            function,
            arguments,
        } if *function == Function::Abs || is_small_with_its_argument(*function) => {
            for argument in arguments {
                add_zeros(graph, *argument, depth, kinks);
            }
        }
        Node::Product(factors) => {
            for (y, n) in factors {
                if *n > 0 {
                    add_zeros(graph, *y, depth, kinks);
                }
            }
        }
        _ if !moves(graph, x) || kinks.contains(&x) => {}
        _ => {
            kinks.push(x);
            if is_variable(graph, x) || linear_term(graph, x).is_some() {
                return;
            }
            for y in graph.reachable(&[x]) {
                if is_variable(graph, y) && !kinks.contains(&y) {
                    kinks.push(y);
                }
            }
        }
    }
}

/// Whether it is an input that may change during a motion.
fn is_variable(graph: &Graph, x: ExprId) -> bool {
    matches!(graph.node(x), Node::Input(input) if !is_at_rest(input))
}

/// Which of the terms of a sum is a multiple of an input that is in none of the others.
fn linear_term(graph: &Graph, sum: ExprId) -> Option<usize> {
    let (_, terms) = graph.as_sum(sum)?;
    (0..terms.len()).find(|at| {
        let (_, y) = terms[*at];
        let mut others = terms.iter().enumerate().filter(|(other, _)| other != at);
        is_variable(graph, y) && !others.any(|(_, (_, z))| graph.reachable(&[*z]).contains(&y))
    })
}

/// The limit of a sum where a quantity vanishes, if it has one from both sides and is not evaluated to that.
fn limit_at(graph: &mut Graph, sum: ExprId, kink: ExprId) -> Option<ExprId> {
    let (sum, leaf) = in_terms_of(graph, sum, kink);
    let from = |graph: &mut Graph, side: i64| {
        let mut approach = Approach {
            leaf: &leaf,
            side,
            slopes: Map::default(),
        };
        approach.limit(graph, sum, MAX_DEPTH)
    };
    let above = from(graph, 1)?;
    let below = from(graph, -1)?;
    if above != below {
        let difference = graph.subtract(above, below);
        let difference = graph.expanded_within(difference, MAX_TERMS)?;
        if !is_zero(graph, difference) {
            return None;
        }
    }
    (from(graph, 0) != Some(above)).then_some(above)
}

/// An expression as one of a quantity that may vanish, and the leaf that is the quantity in it.
fn in_terms_of(graph: &mut Graph, x: ExprId, kink: ExprId) -> (ExprId, Input) {
    if let Node::Input(input) = graph.node(kink) {
        return (x, input.clone());
    }
    let leaf = Input::Placeholder(KINK, Affine::constant(0));
    let value = graph.input(leaf.clone());
    let solution = solution(graph, kink, value);
    let mapping = graph.with_nodes(x, &mut |_, old, _| match solution {
        _ if old == kink => Some(value),
        Some((input, solved)) if old == input => Some(solved),
        _ => None,
    });
    (mapping.of(x), leaf)
}

/// An input in a sum, and what it is where the sum has a value.
fn solution(graph: &mut Graph, sum: ExprId, value: ExprId) -> Option<(ExprId, ExprId)> {
    let at = linear_term(graph, sum)?;
    let (constant, terms) = graph.as_sum(sum)?;
    let mut others = terms.to_vec();
    let (c, input) = others.remove(at);
    let rest = graph.linear(constant, &others);
    let difference = graph.subtract(value, rest);
    Some((input, graph.scale(c.reciprocal()?, difference)))
}

/// How a leaf approaches zero.
struct Approach<'a> {
    leaf: &'a Input,
    /// 1 from above, −1 from below, and 0 at zero itself.
    side: i64,
    /// The slopes found so far; `None` for those that vanish or are not known.
    slopes: Map<ExprId, Option<ExprId>>,
}

impl Approach<'_> {
    /// The limit of an expression without jumps but those at zero; `None` where it is not known.
    fn limit(&mut self, graph: &mut Graph, x: ExprId, depth: usize) -> Option<ExprId> {
        let depth = depth.checked_sub(1)?;
        let mut mapping = Mapping::default();
        for old in graph.reachable(&[x]) {
            let node = graph.node(old).clone();
            let new = match &node {
                Node::Input(input) if input == self.leaf => graph.constant(Constant::ZERO),
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
