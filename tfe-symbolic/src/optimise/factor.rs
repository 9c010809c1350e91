//! Common factors in sums: a b + a c → a (b + c), where that makes the whole cheaper.
//!
//! Extracting a factor saves a product, but may cost one elsewhere that shared `a b`. So factors are first extracted
//! from all sums at once, as long as the estimated cost of the whole decreases, and then one by one, each kept only if
//! the arranged plan costs less. The number of trials depends on the size, to keep compile times linear.

use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::ordered::{SortedMap, SortedSet};
use crate::expr::rewrite::{Mapping, Uses};
use crate::expr::sorting::sort_by_key;
use crate::optimise::binarize::arrange;
use crate::optimise::estimate::estimate;
use crate::optimise::plan::Plan;

/// The total number of operations arranged in single trials for one kernel, over all ways in which it is written. With
/// 50 000, only 3 of 3190 operations of the models of `benches/kernels` are saved in addition.
pub(crate) const BUDGET: usize = 20_000;

/// The number of rounds in which factors are extracted from all sums at once. Nested sums need a round for each level.
const MAX_ROUNDS: usize = 8;

/// A sum and a factor of several of its terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    sum: ExprId,
    factor: ExprId,
    /// The sign of the exponent: a factor, or a divisor.
    divides: bool,
    terms: usize,
}

/// The roots with common factors extracted; at most this number of operations is arranged in single trials.
///
/// The plan is that of the roots: on entry of the given ones, on return of the new ones.
pub(crate) fn take_out_factors(
    graph: &mut Graph,
    roots: Vec<ExprId>,
    plan: Plan,
    budget: usize,
) -> (Vec<ExprId>, Plan) {
    let declared = Trial::of(roots, plan);
    let mut roots = declared.roots.clone();
    let mut least = estimate(graph, &roots);
    // All at once, as long as that seems to help: large models get no further.
    for _ in 0..MAX_ROUNDS {
        let mut all = candidates(graph, &roots);
        sort_by_key(&mut all, |candidate| {
            (candidate.sum, std::cmp::Reverse(candidate.terms))
        });
        all.dedup_by_key(|candidate| candidate.sum);
        let trial = apply(graph, &roots, &all);
        let cost = estimate(graph, &trial);
        if all.is_empty() || cost >= least {
            break;
        }
        roots = trial;
        // The remaining gain is less than the cost of the next round.
        if 100 * (least - cost) < least {
            break;
        }
        least = cost;
    }
    let mut best = declared;
    if best.roots != roots {
        let trial = Trial::arranged(graph, roots);
        if trial.cost < best.cost {
            best = trial;
        }
    }
    let mut budget = budget;
    // One by one, the most promising first. A factor that does not help is not tried again: it would hardly help where
    // the sum is the same.
    let mut tried = SortedSet::new();
    'again: loop {
        let mut all = candidates(graph, &best.roots);
        all.retain(|candidate| !tried.contains(candidate));
        sort_by_key(&mut all, |candidate| std::cmp::Reverse(candidate.terms));
        for candidate in all {
            match budget.checked_sub(best.plan.len()) {
                Some(rest) => budget = rest,
                None => return (best.roots, best.plan),
            }
            let roots = apply(graph, &best.roots, &[candidate]);
            let trial = Trial::arranged(graph, roots);
            tried.insert(candidate);
            if trial.cost < best.cost {
                best = trial;
                continue 'again;
            }
        }
        return (best.roots, best.plan);
    }
}

struct Trial {
    roots: Vec<ExprId>,
    plan: Plan,
    cost: usize,
}

impl Trial {
    fn of(roots: Vec<ExprId>, plan: Plan) -> Self {
        Self {
            roots,
            cost: plan.cost(),
            plan,
        }
    }

    fn arranged(graph: &Graph, roots: Vec<ExprId>) -> Self {
        let plan = arrange(graph, &roots);
        Self::of(roots, plan)
    }
}

/// Factors that several terms of a sum have, among the terms that nothing else uses.
fn candidates(graph: &Graph, roots: &[ExprId]) -> Vec<Candidate> {
    let nodes = graph.reachable(roots);
    let uses = graph.uses(&nodes, roots);
    let mut found = Vec::new();
    for sum in nodes {
        let Some((_, terms)) = graph.as_sum(sum) else {
            continue;
        };
        let mut counts: SortedMap<(ExprId, bool), usize> = SortedMap::new();
        for (_, x) in terms {
            for (factor, exponent) in own_factors(graph, &uses, *x) {
                *counts.get_or_default((*factor, *exponent < 0)) += 1;
            }
        }
        let several = counts.into_iter().filter(|(_, terms)| *terms > 1);
        found.extend(several.map(|((factor, divides), terms)| Candidate {
            sum,
            factor,
            divides,
            terms,
        }));
    }
    found
}

/// The factors of a term that nothing else uses.
fn own_factors<'a>(graph: &'a Graph, uses: &Uses, x: ExprId) -> &'a [(ExprId, i32)] {
    match graph.node(x) {
        Node::Product(factors) if uses.of(x) == 1 => factors,
        _ => &[],
    }
}

fn apply(graph: &mut Graph, roots: &[ExprId], changes: &[Candidate]) -> Vec<ExprId> {
    let nodes = graph.reachable(roots);
    let uses = graph.uses(&nodes, roots);
    let changes: SortedMap<ExprId, Candidate> =
        changes.iter().map(|change| (change.sum, *change)).collect();
    let mut mapping = Mapping::default();
    for old in nodes {
        let change = changes.get(&old);
        if change.is_none() && mapping.keeps(graph.node(old)) {
            continue;
        }
        let node = graph.node(old).clone();
        let new = match (&node, change) {
            (Node::Sum { constant, terms }, Some(change)) => {
                let common = |graph: &Graph, x: ExprId| {
                    let factors = own_factors(graph, &uses, x).iter();
                    let matching =
                        |(x, n): &&(ExprId, i32)| *x == change.factor && (*n < 0) == change.divides;
                    factors.clone().find(matching).map(|(_, n)| *n)
                };
                let exponents = terms.iter().filter_map(|(_, x)| common(graph, *x));
                let exponent = exponents.min_by_key(|n| n.unsigned_abs()).unwrap_or(0);
                let factor = mapping.of(change.factor);
                let (mut inside, mut outside) = (Vec::new(), Vec::new());
                for (c, x) in terms {
                    let mapped = mapping.of(*x);
                    match common(graph, *x).and_then(|_| exponent.checked_neg()) {
                        Some(inverse) => {
                            inside.push((
                                *c,
                                graph.product(Constant::ONE, &[(mapped, 1), (factor, inverse)]),
                            ));
                        }
                        None => outside.push((*c, mapped)),
                    }
                }
                let inside = graph.linear(Constant::ZERO, &inside);
                outside.push((
                    Constant::ONE,
                    graph.product(Constant::ONE, &[(factor, exponent), (inside, 1)]),
                ));
                graph.linear(*constant, &outside)
            }
            (node, _) => graph.remake(node, &mapping),
        };
        mapping.set(old, new);
    }
    roots.iter().map(|root| mapping.of(*root)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::input::Input;

    fn factored(graph: &mut Graph, roots: Vec<ExprId>) -> Vec<ExprId> {
        let plan = arrange(graph, &roots);
        take_out_factors(graph, roots, plan, BUDGET).0
    }

    fn variables<const N: usize>(graph: &mut Graph) -> [ExprId; N] {
        std::array::from_fn(|at| graph.input(Input::Parameter(format!("x{at}"))))
    }

    #[test]
    fn a_factor_comes_out_where_it_saves() {
        // a b + a c + d → a (b + c) + d
        let mut g = Graph::default();
        let [a, b, c, d] = variables(&mut g);
        let (ab, ac) = (g.multiply(a, b), g.multiply(a, c));
        let sum = g.linear(
            Constant::ZERO,
            &[(Constant::ONE, ab), (Constant::ONE, ac), (Constant::ONE, d)],
        );
        let out = factored(&mut g, vec![sum]);
        assert_eq!(g.display(out[0]).to_string(), "x3 + (x0*(x1 + x2))");
    }

    #[test]
    fn a_factor_stays_where_its_products_are_needed_anyway() {
        let mut g = Graph::default();
        let [a, b, c] = variables(&mut g);
        let (ab, ac) = (g.multiply(a, b), g.multiply(a, c));
        let roots = vec![g.add(ab, ac), ab, ac];
        assert_eq!(factored(&mut g, roots.clone()), roots);
    }

    #[test]
    fn a_common_divisor_divides_once() {
        let mut g = Graph::default();
        let [a, b, c] = variables(&mut g);
        let (ac, bc) = (g.divide(a, c), g.divide(b, c));
        let sum = g.add(ac, bc);
        let out = factored(&mut g, vec![sum]);
        let together = g.add(a, b);
        assert_eq!(out[0], g.divide(together, c));
    }
}
