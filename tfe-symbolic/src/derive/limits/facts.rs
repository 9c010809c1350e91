//! What limits ask of expressions.

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;

/// Sums and differences are multiplied out to at most this number of terms.
pub(super) const MAX_TERMS: usize = 64;

/// The factors of an expression without its number.
pub(super) fn factors_of(graph: &Graph, x: ExprId) -> Vec<(ExprId, i32)> {
    let x = graph.as_multiple(x).1;
    match graph.node(x) {
        Node::Product(factors) => factors.clone(),
        _ => vec![(x, 1)],
    }
}

/// The products of an expression with the terms of a sum, each with its coefficient.
pub(super) fn times_terms(graph: &mut Graph, x: ExprId, sum: ExprId) -> Vec<(Constant, ExprId)> {
    let (constant, terms) = graph.terms(sum);
    let mut products = Vec::with_capacity(terms.len() + 1);
    if !constant.is_zero() {
        products.push((constant, x));
    }
    for (c, term) in terms {
        products.push((c, graph.multiply(x, term)));
    }
    products
}

/// Whether an expression is the number zero.
pub(super) fn is_zero(graph: &Graph, x: ExprId) -> bool {
    graph.as_constant(x).is_some_and(Constant::is_zero)
}

/// Whether two expressions are the same when they are multiplied out.
pub(super) fn is_equal(graph: &mut Graph, x: ExprId, y: ExprId) -> bool {
    if x == y {
        return true;
    }
    let difference = graph.subtract(x, y);
    let difference = graph.expanded_within(difference, MAX_TERMS);
    difference.is_some_and(|difference| is_zero(graph, difference))
}

/// u of ln u.
pub(super) fn argument_of_logarithm(graph: &Graph, x: ExprId) -> Option<ExprId> {
    match graph.node(x) {
        Node::Call {
            function: Function::Ln,
            arguments,
        } => arguments.first().copied(),
        _ => None,
    }
}

/// Whether an expression is a field, or an element of one.
pub(super) fn is_field(graph: &Graph, x: ExprId) -> bool {
    matches!(
        graph.node(x),
        Node::Input(Input::Parameter(_) | Input::ParameterElement(..))
    )
}

/// Whether an input never changes during a motion.
pub(super) fn is_at_rest(input: &Input) -> bool {
    matches!(
        input,
        Input::Parameter(_) | Input::ParameterElement(..) | Input::Integer(_)
    )
}

/// Whether an expression may change during a motion.
pub(super) fn moves(graph: &Graph, x: ExprId) -> bool {
    !graph.inputs_of(x).iter().all(is_at_rest)
}

/// Whether it is a positive number, or a sum of a positive number and non-negative terms, as 1 + x².
pub(super) fn is_surely_positive(graph: &Graph, x: ExprId) -> bool {
    let is_positive = |c: Constant| !c.is_zero() && !c.is_negative();
    if let Some(number) = graph.as_constant(x) {
        return is_positive(number);
    }
    let (_, x) = graph.as_multiple(x);
    graph.as_sum(x).is_some_and(|(constant, terms)| {
        is_positive(constant) && terms.iter().all(|(c, _)| is_positive(*c))
    })
}
