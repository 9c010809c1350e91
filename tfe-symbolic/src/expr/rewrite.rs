//! Rewrites of whole expressions: substitution of loop variables, unrolling of sums over ranges, merging of sums that
//! are used once.

use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph, Node, SumRange, TooLong};
use crate::expr::hash::{Map, Set};
use crate::expr::input::{Affine, IndexSymbol, Input, LoopVariable};
use crate::expr::sorting::sort;

/// The most terms that [`Graph::unroll`] writes out, over all sums of an expression.
pub(crate) const UNROLL_LIMIT: u64 = 4096;

/// Up to this number of paths through nested sums, terms are collected path by path, which is faster where few sums are
/// shared.
const MAX_PATHS: usize = 1 << 14;

/// The replacements of expressions that have changed; lookups only.
#[derive(Default)]
pub(crate) struct Mapping(Map<ExprId, ExprId>);

impl Mapping {
    /// The replacement of `old`; itself if it has not changed.
    pub(crate) fn of(&self, old: ExprId) -> ExprId {
        self.0.get(&old).copied().unwrap_or(old)
    }

    pub(crate) fn set(&mut self, old: ExprId, new: ExprId) {
        if new != old {
            self.0.insert(old, new);
        }
    }

    /// Whether no child of a node changed.
    pub(crate) fn keeps(&self, node: &Node) -> bool {
        let mut keeps = true;
        node.for_each_child(|child| keeps &= self.of(child) == child);
        keeps
    }
}

impl Graph {
    /// The node with other children, through the simplifying constructors.
    pub(crate) fn remake(&mut self, node: &Node, mapping: &Mapping) -> ExprId {
        match node {
            Node::Constant(_) | Node::Input(_) => self.intern(node.clone()),
            Node::Sum { constant, terms } => {
                let terms: Vec<_> = terms.iter().map(|(c, x)| (*c, mapping.of(*x))).collect();
                self.linear(*constant, &terms)
            }
            Node::Product(factors) => {
                let factors: Vec<_> = factors.iter().map(|(x, n)| (mapping.of(*x), *n)).collect();
                self.product(Constant::ONE, &factors)
            }
            Node::Power { base, exponent } => self.power(mapping.of(*base), mapping.of(*exponent)),
            Node::Call {
                function,
                arguments,
            } => {
                let arguments: Vec<_> = arguments.iter().map(|x| mapping.of(*x)).collect();
                self.call(*function, &arguments)
            }
            Node::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => {
                let of = |id: &ExprId| mapping.of(*id);
                self.select(*comparison, of(left), of(right), of(then), of(otherwise))
            }
            Node::Loop { range, body } => self.sum(range.clone(), mapping.of(*body)),
        }
    }

    /// The expression with `value` in place of a loop variable, in indices, numbers and inner ranges.
    ///
    /// An index that leaves the 64-bit integers becomes the largest one, which no array has.
    pub fn substitute_loop(
        &mut self,
        id: ExprId,
        variable: LoopVariable,
        value: &Affine,
    ) -> ExprId {
        let mut mapping = Mapping::default();
        for old in self.reachable(&[id]) {
            let new = match self.node(old).clone() {
                Node::Input(input) => {
                    match input.index().filter(|index| index.depends_on(variable)) {
                        Some(index) => {
                            let index = substitute(index, variable, value);
                            self.input(input.with_index(index))
                        }
                        None => old,
                    }
                }
                Node::Loop { range, .. } if range.variable == variable => old,
                Node::Loop { range, body } => {
                    let start = substitute(&range.start, variable, value);
                    let end = substitute(&range.end, variable, value);
                    self.sum(
                        SumRange {
                            variable: range.variable,
                            start,
                            end,
                        },
                        mapping.of(body),
                    )
                }
                node if mapping.keeps(&node) => old,
                node => self.remake(&node, &mapping),
            };
            mapping.set(old, new);
        }
        mapping.of(id)
    }

    /// The expression with other leaves; `None` keeps a leaf as it is. New leaves inside sums may mention the loop variables of the old ones.
    pub(crate) fn with_leaves(
        &mut self,
        id: ExprId,
        new: &mut dyn FnMut(&mut Self, &Input) -> Option<ExprId>,
    ) -> ExprId {
        let mapping = self.with_nodes(id, &mut |graph, old, _| match graph.node(old).clone() {
            Node::Input(input) => new(graph, &input),
            _ => None,
        });
        mapping.of(id)
    }

    /// Rebuilds an expression, children first, with some nodes replaced; `None` rebuilds a node from its new children.
    pub(crate) fn with_nodes(
        &mut self,
        id: ExprId,
        new: &mut dyn FnMut(&mut Self, ExprId, &Mapping) -> Option<ExprId>,
    ) -> Mapping {
        let mut mapping = Mapping::default();
        for old in self.reachable(&[id]) {
            let made = new(self, old, &mapping).unwrap_or_else(|| {
                let node = self.node(old);
                if mapping.keeps(node) {
                    return old;
                }
                let node = node.clone();
                self.remake(&node, &mapping)
            });
            mapping.set(old, made);
        }
        mapping
    }

    /// A constant and terms whose sum is the expression, with nested sums opened.
    pub(crate) fn terms(&self, id: ExprId) -> (Constant, Vec<(Constant, ExprId)>) {
        let mut constant = Constant::ZERO;
        let mut terms = Vec::new();
        let mut waiting = vec![(Constant::ONE, id)];
        let mut steps = 0;
        while let Some((factor, at)) = waiting.pop() {
            steps += 1;
            if steps > MAX_PATHS {
                return self.terms_of_shared(id);
            }
            let (factor, inner) = self.as_multiple_times(factor, at);
            match (self.as_sum(inner), self.as_constant(inner)) {
                (Some((own, inner)), _) => {
                    constant = constant + factor * own;
                    // From a stack they come in their order.
                    waiting.extend(inner.iter().rev().map(|(c, x)| (factor * *c, *x)));
                }
                (None, Some(value)) => constant = constant + factor * value,
                (None, None) => terms.push((factor, inner)),
            }
        }
        (constant, terms)
    }

    /// The same for sums that are shared by several others, and would be opened again on each path: each is opened
    /// once, and like terms are combined.
    fn terms_of_shared(&self, id: ExprId) -> (Constant, Vec<(Constant, ExprId)>) {
        let mut order = Vec::new();
        let mut met: Set<ExprId> = Set::default();
        let mut waiting = vec![id];
        while let Some(x) = waiting.pop() {
            if met.insert(x) {
                order.push(x);
                if let Node::Sum { terms, .. } = self.node(x) {
                    waiting.extend(terms.iter().rev().map(|(_, y)| *y));
                }
            }
        }
        // Children come before their parents.
        let mut parents_first = order.clone();
        sort(&mut parents_first);
        parents_first.reverse();
        let mut factors: Map<ExprId, Constant> = Map::default();
        factors.insert(id, Constant::ONE);
        let mut constant = Constant::ZERO;
        for x in parents_first {
            let Node::Sum {
                constant: own,
                terms,
            } = self.node(x)
            else {
                continue;
            };
            let Some(factor) = factors.get(&x).copied() else {
                continue;
            };
            let in_range = |(c, _): &(Constant, ExprId)| factor.product_in_range(*c).is_some();
            if !terms.iter().all(in_range) {
                continue;
            }
            factors.remove(&x);
            constant = constant + factor * *own;
            for (c, y) in terms {
                let before = factors.get(y).copied().unwrap_or(Constant::ZERO);
                factors.insert(*y, before + factor * *c);
            }
        }
        let mut terms = Vec::new();
        for x in order {
            let factor = factors.get(&x).copied().unwrap_or(Constant::ZERO);
            match self.as_constant(x) {
                Some(value) => constant = constant + factor * value,
                None if factor.is_zero() => {}
                None => terms.push((factor, x)),
            }
        }
        (constant, terms)
    }

    /// The expression with each sum over a literal range written out; other sums stay.
    ///
    /// # Errors
    /// [`TooLong`] if that makes more than a few thousand terms.
    pub fn unroll(&mut self, id: ExprId) -> Result<ExprId, TooLong> {
        let mut current = id;
        let mut written = 0u64;
        // Unrolling an outer sum makes the ranges of inner ones literal: one round for each level of nesting.
        loop {
            let mut mapping = Mapping::default();
            let mut changed = false;
            for old in self.reachable(&[current]) {
                let node = self.node(old).clone();
                let new = match &node {
                    Node::Loop { range, body } => {
                        match (range.start.as_constant(), range.end.as_constant()) {
                            (Some(start), Some(end)) => {
                                changed = true;
                                written = written.saturating_add(end.abs_diff(start));
                                if written > UNROLL_LIMIT {
                                    return Err(TooLong {
                                        terms: written,
                                        limit: UNROLL_LIMIT,
                                    });
                                }
                                let body = mapping.of(*body);
                                let term = |graph: &mut Self, i| {
                                    (
                                        Constant::ONE,
                                        graph.substitute_loop(
                                            body,
                                            range.variable,
                                            &Affine::constant(i),
                                        ),
                                    )
                                };
                                let terms: Vec<_> = (start..end).map(|i| term(self, i)).collect();
                                self.linear(Constant::ZERO, &terms)
                            }
                            _ => self.remake(&node, &mapping),
                        }
                    }
                    _ => self.remake(&node, &mapping),
                };
                mapping.set(old, new);
            }
            current = mapping.of(current);
            if !changed {
                return Ok(current);
            }
        }
    }

    /// Merges each sum that is used once into the sum that uses it, so that like terms meet.
    ///
    /// A sum used twice stays as it is: opening it would repeat its additions. With a factor c, the merge must not cost multiplications:
    /// c(2x + y) opens, c(x + y) does not. A sum whose exact terms may cancel stays as it is, too: another order would lose digits.
    pub(crate) fn open_single_sums(&mut self, roots: &[ExprId]) -> Vec<ExprId> {
        let order = self.reachable(roots);
        let uses = self.uses(&order, roots);
        let mut mapping = Mapping::default();
        for old in order {
            let node = self.node(old).clone();
            let new = match &node {
                Node::Sum { constant, terms } => {
                    let mut constant = *constant;
                    let mut opened = Vec::with_capacity(terms.len());
                    for (outer, x) in terms {
                        let (factor, inner) = self.as_multiple_times(*outer, mapping.of(*x));
                        match self.as_sum(inner).filter(|_| uses.of(*x) == 1) {
                            Some((own, inner))
                                if opening_is_free(factor, own, inner)
                                    && !self.may_cancel_exactly(own, inner) =>
                            {
                                constant = constant + factor * own;
                                opened.extend(inner.iter().map(|(c, y)| (factor * *c, *y)));
                            }
                            _ => opened.push((factor, inner)),
                        }
                    }
                    self.linear(constant, &opened)
                }
                node => self.remake(node, &mapping),
            };
            mapping.set(old, new);
        }
        roots.iter().map(|root| mapping.of(*root)).collect()
    }

    /// How often each of the nodes (all that the roots are made of) is used.
    pub(crate) fn uses(&self, nodes: &[ExprId], roots: &[ExprId]) -> Uses {
        let mut uses = vec![0u32; nodes.last().map_or(0, |last| last.index() + 1)];
        for id in nodes {
            self.node(*id)
                .for_each_child(|child| uses[child.index()] += 1);
        }
        for root in roots {
            uses[root.index()] += 1;
        }
        Uses(uses)
    }
}

/// How often nodes are used.
pub(crate) struct Uses(Vec<u32>);

impl Uses {
    pub(crate) fn of(&self, id: ExprId) -> u32 {
        self.0.get(id.index()).copied().unwrap_or(0)
    }
}

fn opening_is_free(factor: Constant, constant: Constant, terms: &[(Constant, ExprId)]) -> bool {
    let costly = |c: &Constant| !c.abs().is_one();
    let before = usize::from(costly(&factor)) + terms.iter().filter(|(c, _)| costly(c)).count();
    let after = terms.iter().filter(|(c, _)| costly(&(factor * *c))).count();
    let mut numbers = terms.iter().map(|(c, _)| *c).chain([constant]);
    let are_in_range = numbers.all(|c| factor.product_in_range(c).is_some());
    are_in_range && after <= before && (constant.is_zero() || !costly(&factor) || after < before)
}

/// `affine` with `value` in place of the variable, in the places of lists too.
pub(crate) fn substitute(affine: &Affine, variable: LoopVariable, value: &Affine) -> Affine {
    if !affine.depends_on(variable) {
        return affine.clone();
    }
    let mut sum = Affine::constant(affine.constant);
    for (symbol, factor) in &affine.terms {
        let term = match symbol {
            IndexSymbol::Loop(own) if *own == variable => value.clone(),
            // Inside the innermost loop that is left of it.
            IndexSymbol::Within(own) if *own == variable => {
                let left = value.variables().into_iter().max();
                let symbol = left.map(|left| Affine::symbol(IndexSymbol::Within(left)));
                symbol.unwrap_or_default()
            }
            IndexSymbol::Entry(list, place) => {
                let place = substitute(place, variable, value);
                Affine::symbol(IndexSymbol::Entry(list.clone(), place))
            }
            symbol => Affine::symbol(symbol.clone()),
        };
        match sum.plus_scaled(&term, *factor) {
            Some(next) => sum = next,
            None => return Affine::constant(i64::MAX),
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::function::Function;

    fn index(depth: u32) -> Affine {
        Affine::symbol(IndexSymbol::Loop(LoopVariable(depth)))
    }

    fn q(graph: &mut Graph, index: Affine) -> ExprId {
        graph.input(Input::Coordinate(index))
    }

    #[test]
    fn nested_sums_with_dependent_ranges_are_written_out() {
        // Σ_{i<3} Σ_{j=i+1}^{2} q_i q_j = q0 q1 + q0 q2 + q1 q2
        let mut g = Graph::default();
        let (i, j) = (index(0), index(1));
        let (a, b) = (q(&mut g, i.clone()), q(&mut g, j));
        let body = g.multiply(a, b);
        let start = i.plus_scaled(&Affine::constant(1), 1).expect("small");
        let inner = g.sum(
            SumRange {
                variable: LoopVariable(1),
                start,
                end: Affine::constant(3),
            },
            body,
        );
        let outer = SumRange {
            variable: LoopVariable(0),
            start: Affine::constant(0),
            end: Affine::constant(3),
        };
        let sum = g.sum(outer, inner);
        let flat = g.unroll(sum).expect("three terms");
        assert!(!g.contains_sum(flat));
        assert_eq!(g.inputs_of(flat).len(), 3);
        let [a, b, c] = [0, 1, 2].map(|k| q(&mut g, Affine::constant(k)));
        let expected = [(a, b), (a, c), (b, c)].map(|(x, y)| (Constant::ONE, g.multiply(x, y)));
        let expected = g.linear(Constant::ZERO, &expected);
        let [flat, expected] = g.open_single_sums(&[flat, expected])[..] else {
            unreachable!("two roots")
        };
        let difference = g.subtract(flat, expected);
        let opened = g.open_single_sums(&[difference])[0];
        assert!(
            g.as_constant(opened).is_some_and(Constant::is_zero),
            "{}",
            g.display(opened)
        );
    }

    #[test]
    fn long_sums_are_refused() {
        let mut g = Graph::default();
        let body = q(&mut g, index(0));
        let range = SumRange {
            variable: LoopVariable(0),
            start: Affine::constant(0),
            end: Affine::constant(1_000_000),
        };
        let sum = g.sum(range, body);
        assert_eq!(
            g.unroll(sum),
            Err(TooLong {
                terms: 1_000_000,
                limit: UNROLL_LIMIT
            })
        );
    }

    #[test]
    fn terms_of_sums_that_share_sums_are_collected() {
        // u → u + 2v, v → 2u + v: over 2³⁸ paths.
        let mut g = Graph::default();
        let [x, y] = [0, 1].map(|k| q(&mut g, Affine::constant(k)));
        let two = Constant::integer(2);
        let (mut u, mut v) = (x, y);
        for _ in 0..38 {
            let next = |g: &mut Graph, a: ExprId, b: ExprId| {
                g.linear(Constant::ZERO, &[(Constant::ONE, a), (two, b)])
            };
            (u, v) = (next(&mut g, u, v), next(&mut g, v, u));
        }
        let (constant, terms) = g.terms(u);
        assert!(constant.is_zero());
        // ((3ⁿ + (−1)ⁿ)/2, (3ⁿ − (−1)ⁿ)/2)
        let power = 3_i64.pow(38);
        let expected = [(power + 1) / 2, (power - 1) / 2].map(Constant::integer);
        assert_eq!(terms.len(), 2);
        for (c, leaf) in terms {
            assert_eq!(c, expected[usize::from(leaf == y)]);
        }
        // 1/s − w/s² with s = (u + w) + 3v is (u + 3v)/s².
        let w = q(&mut g, Affine::constant(2));
        let (inner, three) = (g.add(u, w), Constant::integer(3));
        let sum = g.linear(Constant::ZERO, &[(Constant::ONE, inner), (three, v)]);
        let one = g.integer(1);
        let below = g.divide(one, sum);
        let share = g.product(Constant::ONE, &[(w, 1), (sum, -2)]);
        let difference = g.subtract(below, share);
        let rest = g.linear(Constant::ZERO, &[(Constant::ONE, u), (three, v)]);
        let expected = g.product(Constant::ONE, &[(rest, 1), (sum, -2)]);
        assert_eq!(difference, expected);
    }

    #[test]
    fn shared_sums_stay_closed() {
        let mut g = Graph::default();
        let [x, y, z] = [0, 1, 2].map(|k| {
            let angle = q(&mut g, Affine::constant(k));
            g.call(Function::Sin, &[angle])
        });
        let inner = g.add(x, y);
        let (a, b) = (g.add(inner, z), g.multiply(inner, z));
        assert_eq!(g.open_single_sums(&[a, b]), vec![a, b]);
        let opened = g.open_single_sums(&[a])[0];
        assert_eq!(g.as_sum(opened).map(|(_, terms)| terms.len()), Some(3));
    }

    #[test]
    fn differences_stay_closed() {
        // (x − y) + (z − w): with x ≈ y and z ≈ w another order would lose all digits.
        let mut g = Graph::default();
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| q(&mut g, Affine::constant(k)));
        let (first, second) = (g.subtract(x, y), g.subtract(z, w));
        let sum = g.add(first, second);
        assert_eq!(g.open_single_sums(&[sum]), vec![sum]);
    }

    #[test]
    fn deep_sums_do_not_overflow_the_stack() {
        let mut g = Graph::default();
        let x = q(&mut g, Affine::constant(0));
        let mut sum = x;
        for _ in 0..200_000 {
            let sine = g.call(crate::expr::function::Function::Sin, &[sum]);
            sum = g.add(sine, x);
        }
        assert_eq!(g.inputs_of(sum).len(), 1);
        let one = g.substitute_loop(sum, LoopVariable(0), &Affine::constant(0));
        assert_eq!(one, sum);
        assert!(g.display(sum).to_string().len() > 200_000);
    }
}
