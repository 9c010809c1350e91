//! Results from other results: what equals a sum or product of things that are computed anyway, although it was not derived that way.
//!
//! ```text
//! K cos²θ + C sin²θ = K + C − (K sin²θ + C cos²θ)        E_ψ = u ∂E/∂w − w ∂E/∂u where E only turns with ψ
//! ```
//!
//! Derivatives of one function are full of such identities, and rules would find few of them. Here all operations are evaluated in a finite
//! field (`residue.rs` beside this file), and for each one that costs more than a few operations by itself, a table of values shows which
//! others it is made of. Two independent evaluations agree by accident once in 10³⁰. A change is kept if the plan costs less and rounding
//! does not do much more harm (`rounding.rs`); no operation becomes undefined where it was defined, for whatever is divided by, or is the
//! argument of a function, was needed before as well.

mod formulas;
mod residue;
mod rounding;
mod search;
#[cfg(test)]
mod tests;

use crate::expr::constant::Constant;
use crate::optimise::plan::{Op, OpId, Plan};
use crate::optimise::rebuild::{Changes, Formula, rebuild};
use rounding::Bounds;
use search::{Candidate, Search};

/// Larger plans are left as they are.
const LARGEST: usize = 130;

/// How often all operations are looked through.
const ROUNDS: usize = 4;

/// How many changes are tried in a round.
const TRIALS: usize = 32;

/// The plan with operations replaced by cheaper formulas.
pub(crate) fn by_identities(plan: Plan) -> Plan {
    let mut best = rebuild(&plan, &Changes::default()).0;
    if best.len() > LARGEST {
        return plan;
    }
    let bounds = Bounds::of(&best);
    for _ in 0..ROUNDS {
        // Doubles are found as products.
        best.push(Op::Constant(Constant::integer(2)));
        let search = Search::of(&best);
        let candidates = search.candidates();
        match improved(&best, candidates, &bounds) {
            Some(better) => best = better,
            None => break,
        }
    }
    rebuild(&best, &Changes::default()).0
}

/// The plan with as many of the replacements as help together.
fn improved(plan: &Plan, candidates: Vec<Candidate>, bounds: &Bounds) -> Option<Plan> {
    let mut changes = Changes::default();
    let (mut best, mut least) = (None, cost(plan));
    for candidate in candidates.into_iter().take(TRIALS) {
        if changes.formulas.contains_key(&candidate.target)
            || needs(plan, &changes, &candidate.formula, candidate.target)
        {
            continue;
        }
        let mut trial = changes.clone();
        trial.formulas.insert(candidate.target, candidate.formula);
        let (other, _) = rebuild(plan, &trial);
        let now = cost(&other);
        if now < least && bounds.hold_for(&other) {
            (best, least, changes) = (Some(other), now, trial);
        }
    }
    best
}

/// The cost of a plan, that of loops by the turns that short ones have.
fn cost(plan: &Plan) -> usize {
    plan.ids().map(|id| weight(plan, id)).sum()
}

fn weight(plan: &Plan, id: OpId) -> usize {
    plan.cost_of(id) << (3 * plan.loops_of(id).count_ones())
}

/// Whether a formula needs the operation that it is to replace, with the changes so far.
fn needs(plan: &Plan, changes: &Changes, formula: &Formula, target: OpId) -> bool {
    let mut stack = formula.operands();
    let mut seen = vec![false; plan.len()];
    while let Some(id) = stack.pop() {
        if id == target {
            return true;
        }
        if !std::mem::replace(&mut seen[id.index()], true) {
            match changes.formulas.get(&id) {
                Some(formula) => stack.extend(formula.operands()),
                None => stack.extend(plan.op(id).operands()),
            }
        }
    }
    false
}
