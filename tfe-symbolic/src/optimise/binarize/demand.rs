//! Which multiples of expressions have to be computed, and what the terms of sums are.

use std::collections::{BTreeMap, BTreeSet};

use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph, Node};

/// A positive multiple of an expression that is no multiple itself.
pub(crate) type Multiple = (ExprId, PositiveConstant);

/// Multiples of sums that are computed as c x + c y instead of c (x + y).
pub(crate) type Opened = BTreeSet<Multiple>;

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
        let key = |c: &Self| (!c.0.is_one(), c.0.to_f64().to_bits(), c.0.as_ratio());
        key(self).cmp(&key(other))
    }
}

/// Multiples c (x + y) of sums that may be opened, because a multiple c x is computed anyway.
pub(crate) fn scaled_sums(graph: &Graph, roots: &[ExprId], opened: &Opened) -> Vec<Multiple> {
    let demanded = demanded(graph, roots, opened);
    let worthwhile = |(x, factor): &Multiple| {
        let terms = graph.as_sum(*x).map_or(&[][..], |(_, terms)| terms);
        let known = |(c, y): &(Constant, ExprId)| {
            demanded.contains_key(&multiple(graph, factor.0 * *c, *y).0)
        };
        *factor != ONE
            // What one loop computes is not there in another.
            && graph.loops_of(*x) == 0
            && !opened.contains(&(*x, *factor)) && terms.iter().any(known)
    };
    demanded.keys().copied().filter(worthwhile).collect()
}

/// The multiple that is the expression itself.
pub(super) const ONE: PositiveConstant = PositiveConstant(Constant::ONE);

/// How often a multiple is used, and how often of that as a term of a sum.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Uses {
    total: usize,
    in_sums: usize,
}

impl Uses {
    fn once_in_a_sum(&self) -> bool {
        self.total == 1 && self.in_sums == 1
    }
}

/// `number ± x ± …`; true for minus.
pub(super) struct Terms {
    pub(super) number: Constant,
    pub(super) terms: BTreeMap<Multiple, bool>,
}

/// c x as a positive multiple of something that is no multiple, and whether the sign was lost.
pub(super) fn multiple(graph: &Graph, c: Constant, x: ExprId) -> (Multiple, bool) {
    let (inner, x) = graph.as_multiple(x);
    let c = c * inner;
    ((x, PositiveConstant(c.abs())), c.is_negative())
}

/// The multiples that have to be computed.
pub(super) fn demanded(
    graph: &Graph,
    roots: &[ExprId],
    opened: &Opened,
) -> BTreeMap<Multiple, Uses> {
    let mut demanded: BTreeMap<Multiple, Uses> = BTreeMap::new();
    let plain = |x: &ExprId| (multiple(graph, Constant::ONE, *x).0, false);
    let mut stack: Vec<(Multiple, bool)> = roots.iter().map(plain).collect();
    while let Some(((x, factor), in_sum)) = stack.pop() {
        let uses = demanded.entry((x, factor)).or_default();
        uses.total += 1;
        uses.in_sums += usize::from(in_sum);
        if uses.total > 1 {
            continue;
        }
        match graph.node(x) {
            Node::Sum { terms, .. } if factor == ONE || opened.contains(&(x, factor)) => {
                let term = |(c, y): &(Constant, ExprId)| multiple(graph, factor.0 * *c, *y).0;
                stack.extend(terms.iter().map(|part| (term(part), true)));
            }
            Node::Product(factors) => stack.extend(factors.iter().map(|(x, _)| plain(x))),
            _ if factor != ONE => stack.push(((x, ONE), false)),
            node => stack.extend(node.children().iter().map(plain)),
        }
    }
    demanded
}

/// The terms of each sum, and the opened sums that have become terms of the only sum that uses them.
pub(super) fn gather(
    graph: &Graph,
    opened: &Opened,
    demanded: &BTreeMap<Multiple, Uses>,
) -> (BTreeMap<Multiple, Terms>, BTreeSet<Multiple>) {
    let mut sums: BTreeMap<Multiple, Terms> = BTreeMap::new();
    let mut merged = BTreeSet::new();
    for (x, factor) in demanded.keys().copied() {
        let Node::Sum { constant, terms } = graph.node(x) else {
            continue;
        };
        if factor != ONE && !opened.contains(&(x, factor)) {
            continue;
        }
        let mut gathered = Terms {
            number: factor.0 * *constant,
            terms: BTreeMap::new(),
        };
        let mut inner = Vec::new();
        for (c, y) in terms {
            let (term, negative) = multiple(graph, factor.0 * *c, *y);
            gathered.terms.insert(term, negative);
            let once = demanded.get(&term).is_some_and(Uses::once_in_a_sum);
            if opened.contains(&term) && once {
                inner.push((term, negative));
            }
        }
        for (term, negative) in inner {
            let Some(own) = sums.get(&term) else { continue };
            // Like terms would have to be collected.
            if own.terms.keys().any(|y| gathered.terms.contains_key(y)) {
                continue;
            }
            gathered.terms.remove(&term);
            let signed = own.terms.iter().map(|(y, sign)| (*y, *sign != negative));
            gathered.terms.extend(signed);
            let number = if negative { -own.number } else { own.number };
            gathered.number = gathered.number + number;
            merged.insert(term);
        }
        sums.insert((x, factor), gathered);
    }
    (sums, merged)
}
