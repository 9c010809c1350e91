//! The direction of differences: a − b or b − a, so that few results are negated.
//!
//! A sign is carried along with a value until a sum absorbs it or a result has to be stored. Both directions of a
//! difference cost the same, and so do the products and sums in which it is used; so each difference is reversed where
//! that leaves fewer negations, alone or together with differences that use it. Among equal choices, the one is
//! preferred in which more differences begin with an operand that is not needed afterwards: it can be overwritten.

use crate::expr::graph::ExprId;
use crate::expr::ordered::SortedSet;
use crate::optimise::plan::{Op, OpId, Plan};
use crate::optimise::rebuild::{Changes, rebuild};

/// The number of differences that are reversed together.
const LONGEST: usize = 4;

/// The number of sets of differences that are tried, times the size of the plan.
const WORK: usize = 300_000;

/// The plan with differences reversed; `plain` are the roots that must not be negated.
pub(crate) fn with_fewer_negations(plan: Plan, plain: &SortedSet<ExprId>) -> Plan {
    let mut signs = Signs::of(&plan, plain);
    signs.search();
    let changes = Changes {
        turned: signs.turned(),
        ..Changes::default()
    };
    rebuild(&plan, &changes).0
}

struct Signs<'a> {
    ops: Vec<&'a Op>,
    /// Stored results with their own signs.
    roots: Vec<(OpId, bool)>,
    /// The sums that each operation goes into, also as part of a product.
    users: Vec<Vec<OpId>>,
    /// The last operation that needs each.
    last: Vec<usize>,
    turned: Vec<bool>,
    negative: Vec<bool>,
    work: usize,
}

impl<'a> Signs<'a> {
    fn of(plan: &'a Plan, plain: &SortedSet<ExprId>) -> Self {
        let stored = plan.values().filter(|(root, _)| plain.contains(root));
        let roots: SortedSet<(OpId, bool)> = stored
            .map(|(_, value)| (value.op, value.negative))
            .collect();
        let mut users = vec![Vec::new(); plan.len()];
        for id in plan.ids() {
            if matches!(
                plan.op(id),
                Op::Add(..) | Op::Subtract(..) | Op::Multiply(..) | Op::Divide(..)
            ) {
                for operand in plan.op(id).operands() {
                    users[operand.index()].push(id);
                }
            }
        }
        let mut last = vec![usize::MAX; plan.len()];
        for id in plan.ids() {
            for operand in plan.op(id).operands() {
                if !matches!(plan.op(operand), Op::Constant(_) | Op::Input(_)) {
                    last[operand.index()] = id.index();
                }
            }
        }
        Self {
            ops: plan.ids().map(|id| plan.op(id)).collect(),
            roots: roots.into_iter().collect(),
            users,
            last,
            turned: vec![false; plan.len()],
            negative: vec![false; plan.len()],
            work: WORK,
        }
    }

    fn turned(&self) -> SortedSet<OpId> {
        let own = self
            .users
            .iter()
            .flatten()
            .chain(self.roots.iter().map(|(op, _)| op));
        own.copied().filter(|id| self.turned[id.index()]).collect()
    }

    fn search(&mut self) {
        let mut least = self.count();
        let mut again = true;
        while again {
            again = false;
            for at in 0..self.ops.len() {
                if self.is_sum(at) && self.turn(at, LONGEST, &mut least) {
                    again = true;
                }
            }
        }
    }

    fn is_sum(&self, at: usize) -> bool {
        matches!(self.ops[at], Op::Add(..) | Op::Subtract(..))
    }

    /// Turns one, and along with it some of those that use it, if that helps.
    fn turn(&mut self, at: usize, more: usize, least: &mut usize) -> bool {
        self.turned[at] ^= self.is_sum(at);
        let now = self.count();
        if now < *least {
            *least = now;
            return true;
        }
        if more > 1 {
            for next in self.users[at].clone() {
                if self.turn(next.index(), more - 1, least) {
                    return true;
                }
            }
        }
        self.turned[at] ^= self.is_sum(at);
        false
    }

    /// The negations that are left, as the plan would be made, and less than one more for all copies.
    fn count(&mut self) -> usize {
        let Some(left) = self.work.checked_sub(self.ops.len()) else {
            return usize::MAX;
        };
        self.work = left;
        let mut plain: SortedSet<usize> = SortedSet::new();
        let mut copies = 0;
        for at in 0..self.ops.len() {
            let of = |id: &OpId| self.negative[id.index()];
            if let Op::Add(a, b) | Op::Subtract(a, b) = self.ops[at] {
                let negative = of(b) != matches!(self.ops[at], Op::Subtract(..));
                let first = if of(a) == self.turned[at] { a } else { b };
                let kept = self.last[first.index()] != at;
                copies += usize::from(of(a) != negative && kept);
            }
            self.negative[at] = match self.ops[at] {
                Op::Add(a, b) => sum(of(a), of(b), self.turned[at]),
                Op::Subtract(a, b) => sum(of(a), !of(b), self.turned[at]),
                Op::Multiply(a, b) | Op::Divide(a, b) => of(a) != of(b),
                Op::Negate(a) => !of(a),
                Op::Loop { body, .. } => of(body),
                Op::Constant(value) => value.is_negative(),
                Op::Input(_) => false,
                other => {
                    let operands = other.operands();
                    let negated = operands
                        .iter()
                        .filter(|id| self.is_negated(id.index(), false));
                    plain.extend(negated.map(|id| id.index()));
                    false
                }
            };
        }
        let stored = self.roots.iter();
        let negated = stored.filter(|(id, negative)| self.is_negated(id.index(), *negative));
        plain.extend(negated.map(|(id, _)| id.index()));
        plain.len() * self.ops.len() + copies
    }

    fn is_negated(&self, at: usize, negative: bool) -> bool {
        self.negative[at] != negative && !matches!(self.ops[at], Op::Constant(_))
    }
}

/// The sign of a sum of values with these signs.
fn sum(a: bool, b: bool, turned: bool) -> bool {
    if a == b { a } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::graph::Graph;
    use crate::expr::input::Input;
    use crate::optimise::binarize::arrange;

    /// Negations of the roots, before and after.
    fn negations(graph: &Graph, roots: &[ExprId]) -> (usize, usize) {
        let plain: SortedSet<ExprId> = roots.iter().copied().collect();
        let count = |plan: &Plan| Signs::of(plan, &plain).count() / plan.len();
        let plan = arrange(graph, roots);
        let before = count(&plan);
        (before, count(&with_fewer_negations(plan, &plain)))
    }

    fn variables<const N: usize>(graph: &mut Graph) -> [ExprId; N] {
        std::array::from_fn(|at| graph.input(Input::Parameter(format!("x{at}"))))
    }

    #[test]
    fn a_difference_is_turned_round() {
        // y − x is written −(x − y).
        let mut g = Graph::default();
        let [x, y, z] = variables(&mut g);
        let difference = g.subtract(y, x);
        let product = g.multiply(difference, z);
        assert_eq!(negations(&g, &[product]), (1, 0));
    }

    #[test]
    fn differences_are_turned_along_with_what_they_go_into() {
        // −(x + (y − z)) = (z − y) − x
        let mut g = Graph::default();
        let [x, y, z, w] = variables(&mut g);
        let (xw, inner) = (g.multiply(x, w), g.subtract(y, z));
        let inner = g.multiply(inner, w);
        let sum = g.add(xw, inner);
        let root = g.negate(sum);
        assert_eq!(negations(&g, &[root]).1, 0);
    }

    #[test]
    fn a_result_with_both_signs_is_negated_once() {
        let mut g = Graph::default();
        let [x, y] = variables(&mut g);
        let difference = g.subtract(x, y);
        let opposite = g.negate(difference);
        assert_eq!(negations(&g, &[difference, opposite]), (1, 1));
    }
}
