//! Computes results from other results: an operation is replaced by a sum or product of values that are computed
//! anyway, if it is equal to it.
//!
//! ```text
//! K cos²θ + C sin²θ = K + C − (K sin²θ + C cos²θ)        E_ψ = u ∂E/∂w − w ∂E/∂u where E only turns with ψ
//! ```
//!
//! Derivatives of one function satisfy many such identities, of which rules would find few. Here all operations are
//! evaluated in a finite field (`residue.rs` beside this file), and for each one that costs more than a few operations
//! by itself, a table of values shows from which others it can be computed. Two independent evaluations agree by
//! accident once in 10³⁰. A change is kept if the plan becomes cheaper and rounding errors do not grow much
//! (`guard.rs`). No operation becomes undefined where it was defined, because all divisors and arguments of functions
//! were needed before as well.

mod formulas;
mod residue;
mod search;
#[cfg(test)]
mod tests;

use crate::expr::constant::Constant;
use crate::optimise::plan::{Op, OpId, Plan};
use crate::optimise::rebuild::{Changes, Formula, rebuild};
use search::{Candidate, Search, weight};

/// Larger plans are left unchanged.
const LARGEST: usize = 130;

/// The number of rounds through all operations.
const ROUNDS: usize = 4;

/// The number of changes tried in a round.
const TRIALS: usize = 32;

/// The plan with operations replaced by cheaper formulas, as long as the plan is accepted.
pub(crate) fn by_identities(plan: Plan, accepts: &dyn Fn(&Plan) -> bool) -> Plan {
    let mut best = rebuild(&plan, &Changes::default()).0;
    if best.len() > LARGEST {
        return plan;
    }
    for _ in 0..ROUNDS {
        // Doubles are found as products.
        best.push(Op::Constant(Constant::integer(2)));
        let search = Search::of(&best);
        let candidates = search.candidates();
        match improved(&best, candidates, accepts) {
            Some(better) => best = better,
            None => break,
        }
    }
    rebuild(&best, &Changes::default()).0
}

/// The plan with as many of the replacements as help together.
fn improved(
    plan: &Plan,
    candidates: Vec<Candidate>,
    accepts: &dyn Fn(&Plan) -> bool,
) -> Option<Plan> {
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
        if now < least && accepts(&other) {
            (best, least, changes) = (Some(other), now, trial);
        }
    }
    best
}

/// The cost of a plan, that of loops by the turns that short ones have.
fn cost(plan: &Plan) -> usize {
    plan.ids().map(|id| weight(plan, id)).sum()
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
