//! Numbers before sums: c (x + y) as c x + c y, where that makes the whole cheaper.
//!
//! Constructors take a number out of a sum whose coefficients are all of one size, which saves products. Where c x is computed anyway, the
//! opposite does: the blocks of masses that attract each other have 3 x off the diagonal, and 3 (x + y) on it. As in `factor.rs`, a change
//! is kept only if the arranged whole costs less, and the number of trials depends on the size.

use crate::expr::graph::{ExprId, Graph};
use crate::optimise::binarize::{Grouping, Opened, arrange_with, scaled_sums};
use crate::optimise::plan::Plan;

/// Operations arranged over all trials of one kernel.
const BUDGET: usize = 25_000;

/// The arranged roots, with such numbers taken to the terms.
pub(crate) fn distribute(graph: &Graph, roots: &[ExprId], grouping: Grouping) -> Plan {
    let mut opened = Opened::new();
    let mut best = arrange_with(graph, roots, &opened, grouping);
    let mut budget = BUDGET;
    // All at once first: large models get no further.
    let all: Opened = scaled_sums(graph, roots, &opened).into_iter().collect();
    if all.is_empty() {
        return best;
    }
    budget = budget.saturating_sub(best.len());
    let trial = arrange_with(graph, roots, &all, grouping);
    if trial.cost() < best.cost() {
        (best, opened) = (trial, all);
    }
    // One by one, as long as one helps: sums that are opened make new ones worthwhile.
    'again: loop {
        for candidate in scaled_sums(graph, roots, &opened) {
            match budget.checked_sub(best.len()) {
                Some(rest) => budget = rest,
                None => return best,
            }
            let mut other = opened.clone();
            other.insert(candidate);
            let trial = arrange_with(graph, roots, &other, grouping);
            if trial.cost() < best.cost() {
                (best, opened) = (trial, other);
                continue 'again;
            }
        }
        return best;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::constant::Constant;
    use crate::expr::input::Input;
    use crate::optimise::binarize::arrange;

    fn products<const N: usize>(graph: &mut Graph) -> [ExprId; N] {
        std::array::from_fn(|at| {
            let [x, y] = [at, at + 1].map(|k| graph.input(Input::Parameter(format!("x{k}"))));
            graph.multiply(x, y)
        })
    }

    /// Saved additions and products, in total.
    fn saved(graph: &Graph, roots: &[ExprId]) -> usize {
        let grouping = Grouping::ByLoops;
        (arrange(graph, roots, grouping).cost() - distribute(graph, roots, grouping).cost()) / 2
    }

    #[test]
    fn multiples_that_are_there_are_added() {
        // 3 x, 3 y, 3 (x + y): neither x nor y by itself is wanted.
        let mut g = Graph::default();
        let three = Constant::integer(3);
        let [x, y] = products(&mut g);
        let sum = g.add(x, y);
        let roots = [x, y, sum].map(|x| g.scale(three, x));
        // a b, b c, their triples, the sum and its triple are six; 3 b, 3 b a, 3 b c and their sum are four.
        assert_eq!(saved(&g, &roots), 2);
    }

    #[test]
    fn opened_sums_join_the_sum_around_them() {
        // z + 3 x and z + 3 (x + w): one addition is shared, and a product is saved.
        let mut g = Graph::default();
        let three = Constant::integer(3);
        let [x, w, z] = products(&mut g);
        let inner = g.add(x, w);
        let (own, triple) = (g.scale(three, x), g.scale(three, inner));
        let triple_w = g.scale(three, w);
        let roots = [g.add(z, own), g.add(z, triple), triple_w];
        assert!(saved(&g, &roots) >= 2);
    }

    #[test]
    fn a_sum_that_is_wanted_itself_keeps_its_number() {
        let mut g = Graph::default();
        let three = Constant::integer(3);
        let [x, y] = products(&mut g);
        let sum = g.add(x, y);
        let roots = [x, y, sum, g.scale(three, sum)];
        assert_eq!(saved(&g, &roots), 0);
    }
}
