//! Products of inverse functions with roots below that vanish with them.
//!
//! ```text
//! acos x/√((1 − x)(1 + x))  →  { 1  where acos x ≤ 0;  acos x/√((1 − x)(1 + x))  elsewhere }
//! ```
//!
//! The slope of acos² x at x = 1 is zero over zero, and −2 in truth; that of acosh² x is 2.

use super::facts::factors_of;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};

/// A product of inverse functions over their roots, with the limit of the quotient where both vanish.
pub(super) fn inverse_functions_over_roots(graph: &mut Graph, x: ExprId) -> ExprId {
    let factors = factors_of(graph, x);
    for (inverse, n) in &factors {
        let Some((root, limit)) = root_and_limit(graph, *inverse).filter(|_| *n > 0) else {
            continue;
        };
        let Some((_, m)) = factors.iter().find(|(y, m)| *y == root && *m < 0) else {
            continue;
        };
        let times = (*n).min(m.saturating_neg());
        let zero = graph.constant(Constant::ZERO);
        let limit = graph.constant(limit);
        let quotient = graph.divide(*inverse, root);
        let quotient = graph.select(Comparison::LessOrEqual, *inverse, zero, limit, quotient);
        let changes = [(*inverse, -times), (root, times), (quotient, times)];
        let coefficient = graph.as_multiple(x).0;
        return graph.product(coefficient, &[&factors[..], &changes].concat());
    }
    x
}

/// The root below the slope of an inverse function that vanishes with it, and the limit of their quotient: acos u = √(1 − u²) (1 + …).
fn root_and_limit(graph: &mut Graph, x: ExprId) -> Option<(ExprId, Constant)> {
    let (function, argument) = match graph.node(x) {
        Node::Call {
            function: function @ (Function::Acos | Function::Acosh),
            arguments,
        } => (*function, *arguments.first()?),
        _ => return None,
    };
    let slope = function.derivative(graph, &[argument], 0);
    let [(root, -1)] = factors_of(graph, slope)[..] else {
        return None;
    };
    let number = graph.as_multiple(slope).0;
    let number = match function {
        Function::Acos => -number,
        _ => number,
    };
    Some((root, number.reciprocal()?))
}
