//! From entries to a program: the same results are written in several ways, and the cheapest that loses no digits is
//! scheduled.

use crate::derive::entry::Entry;
use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph};
use crate::expr::ordered::SortedSet;
use crate::expr::sorting::sort_by_key;
use crate::optimise::angles::expand_angles;
use crate::optimise::binarize::arrange;
use crate::optimise::canonical_order::with_like_operations_alike;
use crate::optimise::estimate::{estimate, is_worth_following};
use crate::optimise::factor::{BUDGET, take_out_factors};
use crate::optimise::guard::Guard;
use crate::optimise::identities::by_identities;
use crate::optimise::passes::{Pass, Passes};
use crate::optimise::plan::Plan;
use crate::optimise::scaled_trig::ScaledTrig;
use crate::optimise::signs::with_fewer_negations;
use crate::program::{Array, Program};
use crate::schedule::balance::{Balance, balances};
use crate::schedule::loop_nest::Block;
use crate::schedule::order::in_order;
use crate::schedule::statements::schedule;
use crate::schedule::store_or_add::settle;

/// Drafts that cost at most this many fifths of the cheapest are followed: common factors and identities may change
/// their order.
const MAX_FIFTHS_OF_CHEAPEST: usize = 6;

/// Identities are searched in the cheapest plans, of this total number of operations: the search takes more than linear
/// time.
const MAX_OPERATIONS_FOR_IDENTITIES: usize = 240;

/// Scaled sines and cosines are tried in drafts up to this cost.
const MAX_COST_FOR_SCALED_TRIG: usize = 300;

/// Longer plans keep their order: in these, registers and not operations limit the speed of a kernel.
const MAX_OPERATIONS_FOR_CANONICAL_ORDER: usize = 1000;

/// A way of writing the results.
struct Way {
    entries: Vec<Entry>,
    estimate: usize,
}

impl Way {
    fn of(graph: &Graph, entries: Vec<Entry>) -> Self {
        let values: Vec<ExprId> = entries.iter().map(|entry| entry.value).collect();
        let estimate = estimate(graph, &values);
        Self { entries, estimate }
    }

    /// Whether all results are the same expressions.
    fn is_the_same(&self, other: &Self) -> bool {
        let mut both = self.entries.iter().zip(&other.entries);
        self.entries.len() == other.entries.len()
            && both.all(|(own, other)| own.value == other.value && own.place == other.place)
    }
}

/// Results in their loops, before common factors are sought.
pub(crate) struct Draft {
    passes: Passes,
    graph: Graph,
    cleared: SortedSet<Array>,
    block: Block,
    balances: Vec<Balance>,
    /// The results as declared.
    plain: Vec<ExprId>,
    /// The results with sines of sums expanded.
    values: Vec<ExprId>,
    /// The values, their operations put in order, once the draft is followed.
    plan: Plan,
}

/// A draft with common factors taken out.
struct Candidate<'a> {
    draft: &'a Draft,
    values: Vec<ExprId>,
    plan: Plan,
}

impl Draft {
    /// Puts entries into loops and expands sines of sums.
    fn of(mut graph: Graph, mut entries: Vec<Entry>, passes: Passes) -> Self {
        // Results of models of run-time length are told entry by entry, and nothing reads them afterwards.
        let balances = match passes.run(Pass::Balance) && !graph.ranges_are_checked {
            true => balances(&mut graph, &mut entries),
            false => Vec::new(),
        };
        let mut values: Vec<ExprId> = entries.iter().map(|entry| entry.value).collect();
        if passes.run(Pass::OpenSums) {
            values = graph.open_single_sums(&values);
        }
        let entries = entries
            .into_iter()
            .zip(values)
            .map(|(entry, value)| Entry { value, ..entry })
            .collect();
        let mut block = Block::of(&mut graph, entries);
        let zero = graph.constant(Constant::ZERO);
        let cleared = settle(&mut block, zero);
        let mut plain = Vec::new();
        block.for_each_value(&mut |value| plain.push(*value));
        let values = match passes.run(Pass::AngleSums) {
            true => expand_angles(&mut graph, plain.clone()),
            false => plain.clone(),
        };
        Self {
            passes,
            graph,
            cleared,
            block,
            balances,
            plain,
            values,
            plan: Plan::default(),
        }
    }

    /// The cheapest program of the same results, written in several ways, that loses no digits; among equal ones the
    /// first.
    ///
    /// The first way is the formula as declared: the others are compared with it, and it is used if no other is
    /// accurate enough.
    pub(crate) fn best(graph: &Graph, written: Vec<Vec<Entry>>, passes: Passes) -> Program {
        let mut ways: Vec<Way> = Vec::with_capacity(written.len());
        for entries in written {
            let way = Way::of(graph, entries);
            if !ways.iter().any(|known| known.is_the_same(&way)) {
                ways.push(way);
            }
        }
        let Some(way) = ways.first() else {
            return Program::default();
        };
        let declared = Self::of(graph.clone(), way.entries.clone(), passes);
        let guard = Guard::of(&declared.graph, &declared.plain);
        let mut drafts = Self::followed(declared, &ways, &guard);
        sort_by_key(&mut drafts, |draft| draft.plan.cost());
        let least = drafts.first().map_or(0, |draft| draft.plan.cost());
        drafts.retain(|draft| 5 * draft.plan.cost() <= MAX_FIFTHS_OF_CHEAPEST * least);
        drafts.dedup_by_key(|draft| draft.plan.cost());
        let share = BUDGET / drafts.len().max(1);
        let mut candidates: Vec<Candidate> = drafts
            .iter_mut()
            .flat_map(|draft| draft.candidates(share, &guard))
            .collect();
        sort_by_key(&mut candidates, |candidate| candidate.plan.cost());
        let mut left = MAX_OPERATIONS_FOR_IDENTITIES;
        for candidate in &mut candidates {
            if left >= candidate.plan.len() {
                left -= candidate.plan.len();
                candidate.take_identities(&guard);
            }
        }
        let best = candidates
            .into_iter()
            .min_by_key(|candidate| (candidate.plan.cost(), candidate.plan.copies()));
        best.map_or_else(Program::default, |best| best.program(&guard))
    }

    /// The drafts that lose no digits and seem to cost little more than the cheapest of these; the declared one, of the
    /// first way, if no other remains.
    fn followed(mut declared: Self, ways: &[Way], guard: &Guard) -> Vec<Self> {
        let mut cheapest_first: Vec<(usize, &Way)> = ways.iter().enumerate().collect();
        sort_by_key(&mut cheapest_first, |(_, way)| way.estimate);
        let mut drafts = Vec::with_capacity(ways.len());
        let (mut least, mut follow_declared) = (None, false);
        for (number, way) in cheapest_first {
            if least.is_some_and(|least| !is_worth_following(way.estimate, least)) {
                break;
            }
            if number == 0 {
                follow_declared = true;
            } else {
                let entries = way.entries.clone();
                let mut draft = Self::of(declared.graph.clone(), entries, declared.passes);
                if !declared.has_the_results_of(&draft) || !draft.arrange(guard) {
                    continue;
                }
                drafts.push(draft);
            }
            least.get_or_insert(way.estimate);
        }
        if follow_declared {
            declared.arrange(guard);
            drafts.insert(0, declared);
        }
        drafts
    }

    /// Whether both write to the same places, in the same way.
    fn has_the_results_of(&self, other: &Self) -> bool {
        self.cleared == other.cleared && self.block.has_the_results_of(&other.block)
    }

    /// Arranges the operations, without expanded sines if these lose digits; returns whether no digits are lost.
    fn arrange(&mut self, guard: &Guard) -> bool {
        self.plan = arrange(&self.graph, &self.values);
        if guard.accepts(&self.plan, &self.values) {
            return true;
        }
        if self.values == self.plain {
            return false;
        }
        self.values.clone_from(&self.plain);
        self.plan = arrange(&self.graph, &self.values);
        guard.accepts(&self.plan, &self.values)
    }

    /// The draft with common factors extracted and, if it is small, with scaled sines and cosines, where these lose no
    /// digits.
    fn candidates(&mut self, budget: usize, guard: &Guard) -> Vec<Candidate<'_>> {
        let mut found = Vec::with_capacity(2);
        if self.passes.run(Pass::ScaledTrig)
            && self.plan.cost() <= MAX_COST_FOR_SCALED_TRIG
            && self.block.inner.is_empty()
            && let Some((arms, values)) = ScaledTrig::of(&mut self.graph, &self.values)
        {
            let factored = match self.passes.run(Pass::CommonFactors) {
                true => {
                    let plan = arrange(&self.graph, &values);
                    take_out_factors(&mut self.graph, values, plan, budget).0
                }
                false => values,
            };
            let roots: Vec<ExprId> = factored.iter().copied().chain(arms.parts()).collect();
            let plan = arms.written_out(arrange(&self.graph, &roots), &factored);
            if guard.accepts(&plan, &factored) {
                found.push((factored, plan));
            }
        }
        let (mut values, mut plan) = (self.values.clone(), self.plan.clone());
        if self.passes.run(Pass::CommonFactors) {
            let (factored, trial) =
                take_out_factors(&mut self.graph, values.clone(), plan.clone(), budget);
            if factored != values && guard.accepts(&trial, &factored) {
                (values, plan) = (factored, trial);
            }
        }
        found.insert(0, (values, plan));
        let draft: &Self = self;
        let candidate = |(values, plan)| Candidate {
            draft,
            values,
            plan,
        };
        found.into_iter().map(candidate).collect()
    }
}

impl Candidate<'_> {
    fn take_identities(&mut self, guard: &Guard) {
        if self.draft.passes.run(Pass::Identities) {
            let accepts = |plan: &Plan| guard.accepts(plan, &self.values);
            self.plan = by_identities(std::mem::take(&mut self.plan), &accepts);
        }
    }

    fn program(self, guard: &Guard) -> Program {
        let Draft {
            passes,
            cleared,
            balances,
            ..
        } = self.draft;
        let mut next = self.values.iter();
        let mut block = self.draft.block.clone();
        block.for_each_value(&mut |value| *value = *next.next().unwrap_or(value));
        let mut plan = self.plan;
        if passes.run(Pass::CanonicalOrder) && plan.len() <= MAX_OPERATIONS_FOR_CANONICAL_ORDER {
            let alike = with_like_operations_alike(plan.clone());
            if guard.accepts(&alike, &self.values) {
                plan = alike;
            }
        }
        if passes.run(Pass::Signs) {
            plan = with_fewer_negations(plan, &block.stored());
        }
        let mut program = schedule(plan, cleared, &block, balances);
        if passes.run(Pass::StatementOrder) {
            program.statements = in_order(program.statements);
        }
        program
    }
}
