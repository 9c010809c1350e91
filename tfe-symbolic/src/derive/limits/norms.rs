//! Products that vanish with a norm by which they are divided, or of which they hold the logarithm.
//!
//! ```text
//! h = √(x² + y²)       ∂(h x)/∂y = x y/h        |x y/h| ≤ h
//!                      ∂(x² ln h)/∂x = 2 x ln h + x³/h²
//! ```
//!
//! A product of higher degree in x and y than its divisor is zero where they are zero: there 0/0 becomes 0/1, by
//! replacing the norm by one. A product of the same degree, such as the direction x/h, or of a lower one, such as the
//! attraction x/h³, has no limit and is unchanged. A logarithm is smaller than any power: where a product of positive
//! degree holds it, 0 ln 0 becomes 0 ln 1. Both may also stand in the terms of a factor that is a sum, as in
//! x² (ln h − 1).

use super::facts::{argument_of_logarithm, factors_of, moves};
use super::norm::{MAX_SUMS, Norm, terms_or_branches};
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;

/// In a sum no more norms than these are examined.
const MAX_NORMS: usize = 8;

/// The expressions examined so far.
#[derive(Default)]
pub(super) struct Norms {
    /// `None` for those that are not norms.
    known: Map<ExprId, Option<Norm>>,
    /// The norms in sums, by the depth to which these are searched.
    in_sums: Map<(ExprId, usize), Vec<Norm>>,
}

impl Norms {
    /// A product in which norms in the denominator, or in logarithms, are replaced by one where the product vanishes with them.
    pub(super) fn limit(&mut self, graph: &mut Graph, x: ExprId) -> ExprId {
        let mut found: Vec<Norm> = Vec::new();
        for factor in factors_of(graph, x) {
            for norm in self.of_factor(graph, factor, MAX_SUMS) {
                if !found.iter().any(|known| known.is(&norm)) {
                    found.push(norm);
                }
            }
        }
        found.iter().fold(x, |x, norm| {
            let coefficient = graph.as_multiple(x).0;
            let factors = factors_of(graph, x);
            match norm.limit(graph, &factors) {
                Some(product) => graph.scale(coefficient, product),
                None => x,
            }
        })
    }

    /// The norms that may make a factor infinite.
    fn of_factor(&mut self, graph: &Graph, (x, n): (ExprId, i32), sums: usize) -> Vec<Norm> {
        if may_be_divided_by(graph, x, n) {
            return self.norm(graph, x).into_iter().collect();
        }
        if n < 0 {
            return Vec::new();
        }
        if let Some(argument) = argument_of_logarithm(graph, x) {
            let factors = factors_of(graph, argument).into_iter();
            let moving = factors.filter(|(y, _)| moves(graph, *y));
            let norm = |(y, _)| self.norm(graph, y).unwrap_or_else(|| Norm::of_argument(y));
            return moving.map(norm).collect();
        }
        match sums.checked_sub(1) {
            Some(sums) => self.of_sum(graph, x, sums),
            None => Vec::new(),
        }
    }

    /// The norm of an expression. Each is examined once.
    fn norm(&mut self, graph: &Graph, x: ExprId) -> Option<Norm> {
        let known = self.known.entry(x);
        known.or_insert_with(|| Norm::of(graph, x)).clone()
    }

    /// The norms that may make terms of a sum, or branches of a choice, infinite; none for anything else.
    pub(super) fn of_sum(&mut self, graph: &Graph, x: ExprId, sums: usize) -> Vec<Norm> {
        if let Some(known) = self.in_sums.get(&(x, sums)) {
            return known.clone();
        }
        let terms = terms_or_branches(graph, x).into_iter();
        let mut found: Vec<Norm> = Vec::new();
        for factor in terms.flat_map(|term| factors_of(graph, term)) {
            for norm in self.of_factor(graph, factor, sums) {
                if found.len() < MAX_NORMS && !found.iter().any(|known| known.is(&norm)) {
                    found.push(norm);
                }
            }
        }
        self.in_sums.insert((x, sums), found.clone());
        found
    }
}

/// Whether a factor is of a kind that may be a norm below, or a power of one.
fn may_be_divided_by(graph: &Graph, x: ExprId, n: i32) -> bool {
    match graph.node(x) {
        Node::Power { .. } => true,
        Node::Call {
            function: Function::Sqrt | Function::Hypot | Function::Abs,
            ..
        }
        | Node::Sum { .. } => n < 0,
        _ => false,
    }
}
