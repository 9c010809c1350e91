//! Gives similar results the same order of operations, so that compilers can compute two of them by one instruction.
//!
//! ```text
//! (I v + C P) + S Q  →  I v + (C P + S Q)        where C P and S Q have the same form
//! g (b + c) + g d    →  g ((b + c) + d)          where g (b + c) is needed anyway
//! ```
//!
//! In sums that belong to similar coordinates, corresponding terms appear in different surroundings; which of them are
//! added first, and which operand of a sum or product comes first, are accidents of the derivation. This pass gives
//! similar operations the same form, at the same cost.

use crate::expr::function::Function;
use crate::expr::input::Input;
use crate::expr::ordered::SortedSet;
use crate::expr::sorting::{sort, sort_by_key};
use crate::optimise::plan::{Op, OpId, Plan, Value};
use crate::optimise::rebuild::{Changes, Formula, rebuild};

/// The number of levels of operands compared to decide which terms are added first.
const LEVELS_OF_TERMS: usize = 2;

/// Functions and choices are looked through to this depth for exact terms.
const MAX_DEPTH: usize = 8;

/// The number of levels of operands compared to decide which operand comes first.
const LEVELS_OF_OPERANDS: usize = 6;

/// The plan with similar operations in the same form.
pub(crate) fn with_like_operations_alike(plan: Plan) -> Plan {
    let plan = with_sums(&plan, |uses, terms| factored(&plan, uses, terms));
    let shapes = shapes(&plan, LEVELS_OF_TERMS, kind);
    with_sums(&plan, |_, terms| regrouped(&shapes, terms))
}

/// Ranks by which the operands of sums and products are ordered: equal for operations that differ only in their inputs.
pub(crate) fn ranks(plan: &Plan) -> Vec<usize> {
    shapes(plan, LEVELS_OF_OPERANDS, |op| match op {
        Op::Call(Function::Cos, _) => Kind::Cosine,
        op => kind(op),
    })
}

/// The plan with another formula for each sum that has one.
fn with_sums(plan: &Plan, formula: impl Fn(&[usize], &[Value]) -> Option<Formula>) -> Plan {
    let uses = uses(plan);
    let mut changes = Changes::default();
    for (sum, terms) in sums(plan, &uses) {
        if let Some(formula) = formula(&uses, &terms) {
            changes.formulas.insert(sum, formula);
        }
    }
    rebuild(plan, &changes).0
}

/// How often each operation is needed.
fn uses(plan: &Plan) -> Vec<usize> {
    let mut uses = vec![0; plan.len()];
    for id in plan.ids() {
        for operand in plan.op(id).operands() {
            uses[operand.index()] += 1;
        }
    }
    for (_, value) in plan.values() {
        uses[value.op.index()] += 1;
    }
    uses
}

fn is_sum(op: &Op) -> bool {
    matches!(op, Op::Add(..) | Op::Subtract(..))
}

/// Whether it has no rounding error: an input, a constant, or an absolute value, choice or multiple of one. What is
/// nested deeper counts as rounded.
fn is_exact(plan: &Plan, id: OpId, depth: usize) -> bool {
    let Some(depth) = depth.checked_sub(1) else {
        return false;
    };
    let is_exact = |id: OpId| is_exact(plan, id, depth);
    match plan.op(id) {
        Op::Constant(_) | Op::Input(_) => true,
        Op::Negate(a) => is_exact(*a),
        Op::Call(Function::Abs | Function::Min | Function::Max, arguments) => {
            arguments.iter().all(|x| is_exact(*x))
        }
        Op::Multiply(a, b) => match plan.op(*a) {
            Op::Constant(value) => value.is_power_of_two() && is_exact(*b),
            _ => false,
        },
        Op::Select {
            then, otherwise, ..
        } => is_exact(*then) && is_exact(*otherwise),
        _ => false,
    }
}

/// The terms of all sums, with their signs. A sum used only once, by another sum, is merged into it, unless it is one of two exact terms: these
/// may cancel, and in another order digits would be lost.
fn sums(plan: &Plan, uses: &[usize]) -> Vec<(OpId, Vec<Value>)> {
    let inside = |sum: OpId, part: OpId| {
        is_sum(plan.op(part))
            && uses[part.index()] == 1
            && plan.loops_of(part) == plan.loops_of(sum)
            && plan.reduces(part) == plan.reduces(sum)
            && !plan
                .op(part)
                .operands()
                .iter()
                .all(|x| is_exact(plan, *x, MAX_DEPTH))
    };
    let parts = |id: OpId| match plan.op(id) {
        Op::Add(a, b) => vec![(*a, false), (*b, false)],
        Op::Subtract(a, b) => vec![(*a, false), (*b, true)],
        _ => Vec::new(),
    };
    let all: Vec<OpId> = plan.ids().filter(|id| is_sum(plan.op(*id))).collect();
    let mut inner = SortedSet::new();
    for sum in &all {
        let parts = parts(*sum).into_iter().map(|(part, _)| part);
        inner.extend(parts.filter(|part| inside(*sum, *part)));
    }
    let whole = all.into_iter().filter(|sum| !inner.contains(sum));
    let terms = |sum: OpId| {
        let (mut terms, mut stack) = (Vec::new(), vec![(sum, false)]);
        while let Some((id, negative)) = stack.pop() {
            if id == sum || inside(sum, id) {
                let signed = |(op, minus): (OpId, bool)| (op, minus != negative);
                stack.extend(parts(id).into_iter().rev().map(signed));
            } else {
                terms.push(Value { negative, op: id });
            }
        }
        terms
    };
    whole.map(|sum| (sum, terms(sum))).collect()
}

/// Two of the terms, g s of a sum s and g x of something else, as one like the first.
fn factored(plan: &Plan, uses: &[usize], terms: &[Value]) -> Option<Formula> {
    let factors = |value: &Value| match plan.op(value.op) {
        Op::Multiply(a, b) => vec![(*a, *b), (*b, *a)],
        _ => Vec::new(),
    };
    for (at, known) in terms.iter().enumerate() {
        for (common, sum) in factors(known) {
            if uses[known.op.index()] < 2 || !is_sum(plan.op(sum)) {
                continue;
            }
            for (other_at, other) in terms.iter().enumerate() {
                let alone = uses[other.op.index()] == 1 && other_at != at;
                let rest = factors(other).into_iter().find(|(x, _)| *x == common);
                let Some((_, rest)) = rest.filter(|(_, rest)| alone && !is_sum(plan.op(*rest)))
                else {
                    continue;
                };
                let signed = |negative, op| Formula::Is(Value { negative, op });
                let inside =
                    Formula::sum(signed(known.negative, sum), signed(other.negative, rest));
                let together = Formula::product(signed(false, common), inside);
                let others = terms.iter().enumerate();
                return others
                    .filter(|(k, _)| *k != at && *k != other_at)
                    .map(|(_, term)| Formula::Is(*term))
                    .chain([together])
                    .reduce(Formula::sum);
            }
        }
    }
    None
}

/// The sum with similar terms grouped; `None` if there are none.
fn regrouped(shapes: &[usize], terms: &[Value]) -> Option<Formula> {
    let mut groups: Vec<(usize, Vec<Value>)> = Vec::new();
    for term in terms {
        let shape = shapes[term.op.index()];
        match groups.iter_mut().find(|(known, _)| *known == shape) {
            Some((_, group)) => group.push(*term),
            None => groups.push((shape, vec![*term])),
        }
    }
    if groups.len() < 2 || groups.iter().all(|(_, group)| group.len() < 2) {
        return None;
    }
    // Groups first, then what stands alone.
    sort_by_key(&mut groups, |(_, group)| group.len() < 2);
    let sums = groups
        .into_iter()
        .filter_map(|(_, group)| group.into_iter().map(Formula::Is).reduce(Formula::sum));
    sums.reduce(Formula::sum)
}

/// The kind of an operation. Sums and differences are of one kind, and so are sines and cosines unless stated
/// otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Constant,
    Parameter,
    Coordinate,
    Rate,
    Cosine,
    Sine,
    Product,
    Sum,
    Quotient,
    Other,
}

fn kind(op: &Op) -> Kind {
    match op {
        Op::Constant(_) => Kind::Constant,
        Op::Input(Input::Coordinate(_)) => Kind::Coordinate,
        Op::Input(Input::Velocity(_) | Input::Momentum(_)) => Kind::Rate,
        Op::Input(_) => Kind::Parameter,
        Op::Call(Function::Sin | Function::Cos, _) => Kind::Sine,
        Op::Add(..) | Op::Subtract(..) => Kind::Sum,
        Op::Multiply(..) => Kind::Product,
        Op::Divide(..) => Kind::Quotient,
        _ => Kind::Other,
    }
}

/// A kind and the shapes of operands as one number, in the order of kinds and then of operands: numbers are compared faster than lists.
///
/// No operation has more operands than the four of a choice, and no plan 2³⁰ operations.
fn in_one_number(kind: Kind, operands: &[usize]) -> u128 {
    const OPERANDS: usize = 4;
    const BITS: u32 = 30;
    debug_assert!(operands.len() <= OPERANDS);
    let mut number = kind as u128;
    for at in 0..OPERANDS {
        // A list comes before a longer one that begins with it.
        let operand = operands.get(at).map_or(0, |shape| *shape as u128 + 1);
        number = number << BITS | operand;
    }
    number
}

/// The shape of each operation, down to this number of levels of operands: equal numbers mean equal shapes.
fn shapes(plan: &Plan, levels: usize, kind: impl Fn(&Op) -> Kind) -> Vec<usize> {
    let kinds: Vec<Kind> = plan.ids().map(|id| kind(plan.op(id))).collect();
    // Of what lies deeper, only that it is an operation.
    let mut shapes: Vec<usize> = kinds
        .iter()
        .map(|kind| *kind.min(&Kind::Product) as usize)
        .collect();
    for _ in 0..levels {
        let made: Vec<u128> = plan
            .ids()
            .zip(&kinds)
            .map(|(id, kind)| {
                let operands = match kind {
                    Kind::Sine | Kind::Cosine => Vec::new(),
                    _ => plan.op(id).operands(),
                };
                let mut operands: Vec<usize> = operands.iter().map(|x| shapes[x.index()]).collect();
                if matches!(kind, Kind::Sum | Kind::Product) {
                    sort(&mut operands);
                }
                in_one_number(*kind, &operands)
            })
            .collect();
        let mut all = made.clone();
        sort(&mut all);
        all.dedup();
        shapes = made
            .iter()
            .map(|shape| all.binary_search(shape).unwrap_or(0))
            .collect();
    }
    shapes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::graph::{ExprId, Graph};
    use crate::expr::input::Affine;
    use crate::optimise::binarize::arrange;

    fn parameter(graph: &mut Graph, name: &str) -> ExprId {
        graph.input(Input::Parameter(name.to_owned()))
    }

    fn velocity(graph: &mut Graph, index: i64) -> ExprId {
        graph.input(Input::Velocity(Affine::constant(index)))
    }

    /// The operands of the sum that a root has become.
    #[track_caller]
    fn terms(plan: &Plan, root: ExprId) -> [Op; 2] {
        let value = plan.value(root).expect("a root");
        match plan.op(value.op) {
            Op::Add(a, b) => [a, b].map(|id| plan.op(*id).clone()),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn like_terms_are_added_first() {
        // a v₀ + v₁ v₂ + b v₁ → (a v₀ + b v₁) + v₁ v₂
        let mut g = Graph::default();
        let [a, b] = ["a", "b"].map(|name| parameter(&mut g, name));
        let [v0, v1, v2] = [0, 1, 2].map(|k| velocity(&mut g, k));
        let (first, other, last) = (g.multiply(a, v0), g.multiply(v1, v2), g.multiply(b, v1));
        let sum = g.add(first, other);
        let sum = g.add(sum, last);
        let plan = arrange(&g, &[sum]);
        let (cost, plan) = (plan.cost(), with_like_operations_alike(plan));
        assert_eq!(plan.cost(), cost);
        // One of both terms is the product of velocities alone.
        let alone = terms(&plan, sum).into_iter().filter(|op| {
            let velocity = |id: &OpId| kind(plan.op(*id)) == Kind::Rate;
            matches!(op, Op::Multiply(..)) && op.operands().iter().all(velocity)
        });
        assert_eq!(alone.count(), 1);
    }

    #[test]
    fn a_term_joins_a_like_product() {
        // g (b + c), g (b + c) + g d → g ((b + c) + d)
        let mut g = Graph::default();
        let [gravity, b, c, d] = ["g", "b", "c", "d"].map(|name| parameter(&mut g, name));
        let inner = g.add(b, c);
        let (known, other) = (g.multiply(gravity, inner), g.multiply(gravity, d));
        let sum = g.add(known, other);
        let plan = arrange(&g, &[known, sum]);
        let (cost, plan) = (plan.cost(), with_like_operations_alike(plan));
        assert_eq!(plan.cost(), cost);
        let value = plan.value(sum).expect("a root");
        assert!(matches!(plan.op(value.op), Op::Multiply(..)));
    }

    #[test]
    fn like_operations_have_their_operands_in_like_order() {
        let mut g = Graph::default();
        let [a, b] = ["a", "b"].map(|name| parameter(&mut g, name));
        let [v0, v1] = [0, 1].map(|k| velocity(&mut g, k));
        let (first, last) = (g.multiply(a, v0), g.multiply(b, v1));
        let plan = arrange(&g, &[first, last]);
        let ranks = ranks(&plan);
        let [first, last] = [first, last].map(|root| plan.value(root).expect("a root").op);
        assert_eq!(ranks[first.index()], ranks[last.index()]);
        let of = |input: Input| ranks[plan.find(&Op::Input(input)).expect("an input").index()];
        let velocity = Input::Velocity(Affine::constant(0));
        assert!(of(Input::Parameter("a".to_owned())) < of(velocity));
    }
}
