//! An estimate of the cost of results, as if every node of their expressions were computed once in its present order;
//! linear in their size.
//!
//! It tells which of several ways of writing the same results are worth running the passes on.

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::program::cost;

/// Ways of writing whose estimate is more than this many halves of the lowest one are dropped: on the models of
/// `benches/kernels`, the way that ends up cheapest has an estimate of at most 1.4 times the lowest.
pub(crate) const MAX_HALVES_OF_CHEAPEST: usize = 3;

/// The estimated cost of results.
pub(crate) fn estimate(graph: &Graph, roots: &[ExprId]) -> usize {
    let nodes = graph.reachable(roots);
    nodes.into_iter().map(|id| of_node(graph.node(id))).sum()
}

/// Whether something of this estimate is worth following beside the cheapest.
pub(crate) fn is_worth_following(estimate: usize, cheapest: usize) -> bool {
    2 * estimate <= MAX_HALVES_OF_CHEAPEST * cheapest
}

fn of_node(node: &Node) -> usize {
    match node {
        Node::Constant(_) | Node::Input(_) => 0,
        Node::Sum { constant, terms } => {
            let additions = terms.len() - usize::from(constant.is_zero() && !terms.is_empty());
            let costly = |(c, _): &&(Constant, ExprId)| !c.abs().is_one();
            cost::ADDITION * additions + cost::PRODUCT * terms.iter().filter(costly).count()
        }
        Node::Product(factors) => {
            let (mut products, mut quotients) = (0, 0);
            for (_, exponent) in factors {
                products += exponent.unsigned_abs().min(8) as usize;
                quotients += usize::from(*exponent < 0);
            }
            cost::PRODUCT * products.saturating_sub(1) + cost::QUOTIENT * quotients.min(1)
        }
        // A sine is counted with its cosine.
        Node::Call {
            function: Function::Sin | Function::Cos,
            ..
        } => cost::SINE_WITH_COSINE / 2,
        Node::Power { .. } | Node::Call { .. } => cost::FUNCTION,
        Node::Select { .. } => cost::CHOICE,
        Node::Loop { .. } => cost::ADDITION,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::input::Input;

    #[test]
    fn shared_nodes_count_once() {
        // (x y + 2 z)² + x y: products x y, 2 z, the square; two sums
        let mut g = Graph::default();
        let [x, y, z] = ["x", "y", "z"].map(|name| g.input(Input::Parameter(name.to_owned())));
        let xy = g.multiply(x, y);
        let two = Constant::rational(2, 1).expect("two");
        let sum = g.linear(Constant::ZERO, &[(Constant::ONE, xy), (two, z)]);
        let square = g.product(Constant::ONE, &[(sum, 2)]);
        let root = g.add(square, xy);
        assert_eq!(
            estimate(&g, &[root, xy]),
            3 * cost::PRODUCT + 2 * cost::ADDITION
        );
    }
}
