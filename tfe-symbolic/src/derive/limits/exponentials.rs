//! Quotients of exponentials, far from where these are of the size of one.
//!
//! ```text
//! E = eᵘ,  S = r + d E        E/S² = 1/(S (r/E + d))
//! ```
//!
//! The slope E/S² of a logistic function 1/S is infinite over infinite where E is infinite, and zero in truth. Divided by
//! E, a sum is finite there.

use super::facts::{factors_of, moves};
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};

/// A product of an exponential over sums with it, in terms of these sums divided by it.
pub(super) fn over_exponentials(graph: &mut Graph, x: ExprId) -> ExprId {
    let factors = factors_of(graph, x);
    for (exponential, k) in &factors {
        if *k <= 0 || !is_exponential(graph, *exponential) {
            continue;
        }
        for (sum, m) in &factors {
            let divided = match *m {
                1 => terms_times(graph, *sum, (*exponential, *k))
                    .map(|divided| [(*exponential, -k), (*sum, -1), (divided, 1)]),
                m if m < 0 => sum_over(graph, *sum, *exponential).map(|quotient| {
                    let times = (*k).min(m.saturating_neg());
                    [(*exponential, -times), (*sum, times), (quotient, -times)]
                }),
                _ => None,
            };
            if let Some(changes) = divided {
                let coefficient = graph.as_multiple(x).0;
                return graph.product(coefficient, &[&factors[..], &changes].concat());
            }
        }
    }
    x
}

fn is_exponential(graph: &Graph, x: ExprId) -> bool {
    matches!(
        graph.node(x),
        Node::Call {
            function: Function::Exp,
            ..
        }
    )
}

/// S/E of a sum S of multiples of E and of what is at rest; `None` for other sums.
fn sum_over(graph: &mut Graph, sum: ExprId, exponential: ExprId) -> Option<ExprId> {
    let (constant, terms) = graph.as_sum(sum)?;
    let (mut multiples, mut others) = (Vec::new(), Vec::new());
    for (c, term) in terms {
        let factors = factors_of(graph, *term);
        let (own, rest): (Vec<_>, Vec<_>) =
            factors.into_iter().partition(|(y, _)| *y == exponential);
        if rest.iter().any(|(y, _)| moves(graph, *y)) {
            return None;
        }
        match own[..] {
            [] => others.push((*c, *term)),
            [(_, 1)] => multiples.push((*c, *term)),
            _ => return None,
        }
    }
    if multiples.is_empty() {
        return None;
    }
    let rest = graph.linear(constant, &others);
    let mut divided = vec![(Constant::ONE, graph.divide(rest, exponential))];
    for (c, term) in multiples {
        divided.push((c, graph.divide(term, exponential)));
    }
    Some(graph.linear(Constant::ZERO, &divided))
}

/// The sum of the terms of a sum times Eᵏ, if each is over a sum with E.
fn terms_times(graph: &mut Graph, sum: ExprId, (exponential, k): (ExprId, i32)) -> Option<ExprId> {
    let (constant, terms) = graph.as_sum(sum)?;
    if !constant.is_zero() {
        return None;
    }
    let terms = terms.to_vec();
    let mut products = Vec::with_capacity(terms.len());
    for (c, term) in terms {
        let mut factors = factors_of(graph, term);
        let is_over = |graph: &mut Graph, (y, n): (ExprId, i32)| {
            n < 0 && sum_over(graph, y, exponential).is_some()
        };
        if !factors.iter().any(|factor| is_over(graph, *factor)) {
            return None;
        }
        factors.push((exponential, k));
        let number = graph.as_multiple(term).0;
        let product = graph.product(number, &factors);
        products.push((c, over_exponentials(graph, product)));
    }
    Some(graph.linear(Constant::ZERO, &products))
}
