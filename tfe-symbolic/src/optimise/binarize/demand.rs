//! The multiples of expressions that have to be computed, and the terms of sums.

use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Set;
use crate::expr::ordered::{SortedMap, SortedSet};

/// A positive multiple of an expression that is itself not a multiple.
pub(crate) type Multiple = (ExprId, PositiveConstant);

/// A constant with an (arbitrary, but fixed) order in which 1 is the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PositiveConstant(pub(super) Constant);

impl PartialOrd for PositiveConstant {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for PositiveConstant {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        if self == other {
            return std::cmp::Ordering::Equal;
        }
        let key = |c: &Self| (!c.0.is_one(), c.0.to_f64().to_bits(), c.0.as_ratio());
        key(self).cmp(&key(other))
    }
}

/// The multiple that is the expression itself.
pub(super) const ONE: PositiveConstant = PositiveConstant(Constant::ONE);

/// `number ± x ± …`; true for minus.
pub(super) struct Terms {
    pub(super) number: Constant,
    pub(super) terms: SortedMap<Multiple, bool>,
}

impl Terms {
    /// How many there are, with the number.
    pub(super) fn count(&self) -> usize {
        self.terms.len() + usize::from(!self.number.is_zero())
    }
}

/// c x as a positive multiple of an expression that is itself not a multiple, and whether its sign has been dropped.
pub(super) fn multiple(graph: &Graph, c: Constant, x: ExprId) -> (Multiple, bool) {
    let (c, x) = graph.as_multiple_times(c, x);
    ((x, PositiveConstant(c.abs())), c.is_negative())
}

/// The multiples that have to be computed.
pub(super) fn demanded(graph: &Graph, roots: &[ExprId]) -> SortedSet<Multiple> {
    let (mut demanded, mut known) = (Vec::new(), Set::default());
    let plain = |x: &ExprId| multiple(graph, Constant::ONE, *x).0;
    let mut stack: Vec<Multiple> = roots.iter().map(plain).collect();
    while let Some((x, factor)) = stack.pop() {
        if !known.insert((x, factor)) {
            continue;
        }
        demanded.push((x, factor));
        match graph.node(x) {
            Node::Sum { terms, .. } if factor == ONE => {
                stack.extend(terms.iter().map(|(c, y)| multiple(graph, *c, *y).0));
            }
            Node::Product(factors) => stack.extend(factors.iter().map(|(x, _)| plain(x))),
            _ if factor != ONE => stack.push((x, ONE)),
            node => stack.extend(node.children().iter().map(plain)),
        }
    }
    demanded.into_iter().collect()
}

/// The terms of each sum.
pub(super) fn gather(graph: &Graph, demanded: &SortedSet<Multiple>) -> SortedMap<Multiple, Terms> {
    let mut sums: SortedMap<Multiple, Terms> = SortedMap::new();
    for (x, factor) in demanded.iter().filter(|(_, factor)| *factor == ONE) {
        if let Node::Sum { constant, terms } = graph.node(*x) {
            let sum = Terms {
                number: *constant,
                terms: terms.iter().map(|(c, y)| multiple(graph, *c, *y)).collect(),
            };
            sums.insert((*x, *factor), sum);
        }
    }
    sums
}
