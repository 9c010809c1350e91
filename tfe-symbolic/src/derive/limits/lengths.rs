//! Limits where a norm vanishes if a field beside it does: of springs whose length without a force is zero.
//!
//! ```text
//! h = √(x² + y²)       ∂²(h − l)²/∂x² = 2 x²/h² + 2 (h − l) y²/h³  →  { 2  where l = 0 and h ≤ 10⁻¹⁰⁰;  …  elsewhere }
//! ```
//!
//! Where l is another number there is no limit: the force has the size of 2 l in each direction. A length is the sum of the terms at rest
//! in a sum that vanishes with the norm otherwise. The limit is that of the entry with zero in place of the length.

use super::facts::{factors_of, is_field, moves};
use super::norm::{MAX_DEPTH, Norm};
use super::powers::ROUNDING;
use super::together::{TINY, limit_of_sum, replaced};
use crate::derive::entry::Entry;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::program::Array;

/// A norm, and what is zero where there is a limit.
struct Length {
    norm: Norm,
    root: ExprId,
    length: ExprId,
    /// A node, and what it is where the length is zero: a field, or the sums with the length.
    at_zero: Vec<(ExprId, ExprId)>,
}

/// Rewrites entries so that they have their limits where a norm and a length vanish.
pub(super) fn take_limits_where_lengths_vanish(graph: &mut Graph, entries: &mut [&mut Entry]) {
    let roots: Vec<ExprId> = entries.iter().map(|entry| entry.value).collect();
    let lengths = lengths_in(graph, &roots);
    if lengths.is_empty() {
        return;
    }
    // A copy in which limits are sought, because expressions made in vain would change the order of later ones.
    let mut trial = graph.clone();
    for entry in entries {
        // Forces have all their digits down to zero.
        let most = match entry.place.array {
            Array::ByZ | Array::ByQ | Array::Force => 0.0,
            _ => TINY,
        };
        for length in &lengths {
            if length.with_limit(&mut trial, (entry.value, most)).is_some()
                && let Some(value) = length.with_limit(graph, (entry.value, most))
            {
                entry.value = value;
            }
        }
    }
}

/// The norms in expressions with the lengths beside them.
fn lengths_in(graph: &mut Graph, roots: &[ExprId]) -> Vec<Length> {
    let nodes = graph.reachable(roots);
    let is_root = |x: &ExprId| {
        matches!(
            graph.node(*x),
            Node::Call {
                function: Function::Sqrt | Function::Hypot,
                ..
            }
        )
    };
    let norms: Vec<Norm> = nodes
        .iter()
        .filter(|x| is_root(x))
        .filter_map(|x| Norm::of(graph, *x).filter(|norm| norm.root == Some(*x)))
        .collect();
    let mut lengths: Vec<Length> = Vec::new();
    for norm in norms {
        for sum in &nodes {
            if let Some(length) = Length::of(graph, &norm, *sum) {
                add(graph, &mut lengths, length);
            }
        }
    }
    lengths
}

/// Adds a length, or the sum of it to the same one.
fn add(graph: &Graph, lengths: &mut Vec<Length>, new: Length) {
    let size = |x: ExprId| graph.as_multiple(x).1;
    let is_same = |own: &&mut Length| own.root == new.root && size(own.length) == size(new.length);
    match lengths.iter_mut().find(is_same) {
        Some(known) => known.at_zero.extend(new.at_zero),
        None => lengths.push(new),
    }
}

impl Length {
    /// The terms at rest in a sum of which all others vanish with the norm.
    fn of(graph: &mut Graph, norm: &Norm, sum: ExprId) -> Option<Self> {
        let (constant, terms) = graph.as_sum(sum)?;
        let (moving, rest): (Vec<_>, Vec<_>) =
            terms.iter().copied().partition(|(_, y)| moves(graph, *y));
        let vanishes = |(_, y): &(Constant, ExprId)| norm.degree(graph, *y, MAX_DEPTH) > ROUNDING;
        let root = norm.root?;
        if moving.is_empty() || rest.is_empty() || !moving.iter().all(vanishes) {
            return None;
        }
        if !graph.reachable(&[sum]).contains(&root) {
            return None;
        }
        // Of k h − k l the length is l, and k h − 2 k has none.
        let is_common = |factor: &(ExprId, i32)| {
            moving
                .iter()
                .all(|(_, y)| factors_of(graph, *y).contains(factor))
        };
        let (length, at_zero) = match rest[..] {
            [(_, product)] if constant.is_zero() => {
                let mut factors = factors_of(graph, product);
                factors.retain(|factor| !is_common(factor));
                match factors[..] {
                    [] => return None,
                    [(field, 1)] if is_field(graph, field) => {
                        (field, (field, graph.constant(Constant::ZERO)))
                    }
                    _ => {
                        let length = graph.product(Constant::ONE, &factors);
                        (length, (sum, graph.linear(Constant::ZERO, &moving)))
                    }
                }
            }
            _ if rest
                .iter()
                .flat_map(|(_, y)| factors_of(graph, *y))
                .any(|factor| is_common(&factor)) =>
            {
                return None;
            }
            _ => {
                let length = graph.linear(constant, &rest);
                (length, (sum, graph.linear(Constant::ZERO, &moving)))
            }
        };
        Some(Self {
            norm: norm.clone(),
            root,
            length,
            at_zero: vec![at_zero],
        })
    }

    /// An entry with the limit of its terms where the norm is not larger than a number; `None` if they have none.
    fn with_limit(&self, graph: &mut Graph, (x, most): (ExprId, f64)) -> Option<ExprId> {
        let (coefficient, inner) = graph.as_multiple(x);
        let Some((constant, terms)) = graph.as_sum(inner) else {
            let limit = self.limit(graph, (inner, most))?;
            return Some(graph.scale(coefficient, limit));
        };
        let (own, mut terms): (Vec<_>, Vec<_>) = terms
            .iter()
            .copied()
            .partition(|(_, y)| self.divides(graph, *y));
        let own = graph.linear(Constant::ZERO, &own);
        terms.push((Constant::ONE, self.limit(graph, (own, most))?));
        let sum = graph.linear(constant, &terms);
        Some(graph.scale(coefficient, sum))
    }

    /// Whether an expression is divided by the norm.
    fn divides(&self, graph: &Graph, x: ExprId) -> bool {
        let is_below = |(y, n): &(ExprId, i32)| {
            let degree = self.norm.own_degree(graph, *y, MAX_DEPTH);
            degree.is_some_and(|degree| degree * f64::from(*n) < 0.0)
        };
        let mut nodes = graph.reachable(&[x]).into_iter();
        nodes.any(|y| match graph.node(y) {
            Node::Product(factors) => factors.iter().any(is_below),
            _ => false,
        })
    }

    /// The limit where norm and length vanish, and the expression elsewhere.
    fn limit(&self, graph: &mut Graph, (x, most): (ExprId, f64)) -> Option<ExprId> {
        if !self.divides(graph, x) {
            return None;
        }
        let without = replaced(graph, x, &self.at_zero);
        if without == x {
            return None;
        }
        let limit = limit_of_sum(graph, &self.norm, without)?;
        let most = graph.constant(Constant::float(most));
        let [zero, one] = [0, 1].map(|number| graph.integer(number));
        let size = graph.call(Function::Abs, &[self.length]);
        let distance = graph.select(Comparison::LessOrEqual, size, zero, self.root, one);
        Some(graph.select(Comparison::LessOrEqual, distance, most, limit, x))
    }
}
