//! From entries to a program: several ways to write the same results, of which the cheapest is scheduled.

use std::collections::BTreeSet;

use crate::derive::entry::Entry;
use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph};
use crate::optimise::angles::expand_angles;
use crate::optimise::binarize::{Grouping, arrange};
use crate::optimise::canonical_order::with_like_operations_alike;
use crate::optimise::distribute::distribute;
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

/// Of the drafts, those that cost no more than so many fifths of the cheapest are followed: identities may change their order.
const WITHIN: usize = 6;

/// Drafts up to this cost are also multiplied out before common factors are sought.
const MULTIPLIED: usize = 55;

/// Drafts up to this cost are also written by arms.
const ARMED: usize = 300;

/// Identities are sought in the cheapest plans, where they cost no more than so many quarters of the cheapest, up to so many operations
/// altogether.
const CLOSE: usize = 6;
const FOLLOWED: usize = 240;

/// Entries in their loops, before common factors are sought.
pub(crate) struct Draft {
    passes: Passes,
    graph: Graph,
    cleared: BTreeSet<Array>,
    block: Block,
    balances: Vec<Balance>,
    /// The results as declared.
    plain: Vec<ExprId>,
    /// The results with sines of sums expanded.
    values: Vec<ExprId>,
    cost: usize,
}

/// A draft with its operations arranged.
struct Arranged<'a> {
    draft: &'a Draft,
    values: Vec<ExprId>,
    plan: Plan,
}

impl Draft {
    /// Puts entries into loops and expands sines of sums.
    pub(crate) fn of(mut graph: Graph, mut entries: Vec<Entry>, passes: Passes) -> Self {
        let balances = match passes.run(Pass::Balance) {
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
        let cost = arrange(&graph, &values, Grouping::ByLoops).cost();
        Self {
            passes,
            graph,
            cleared,
            block,
            balances,
            plain,
            values,
            cost,
        }
    }

    /// The program of the cheapest of these drafts of the same results that loses no digits; of equal ones the first.
    ///
    /// The first draft is the one as declared: the others are compared with it, and it is taken where no other is good enough.
    pub(crate) fn best(drafts: Vec<Self>) -> Program {
        let Some(declared) = drafts.first() else {
            return Program::default();
        };
        let guard = Guard::of(&declared.graph, &declared.plain);
        let mut drafts = Self::accepted(drafts, &guard);
        drafts.sort_by_key(|draft| draft.cost);
        let least = drafts.first().map_or(0, |draft| draft.cost);
        drafts.retain(|draft| 5 * draft.cost <= WITHIN * least);
        drafts.dedup_by_key(|draft| draft.cost);
        let share = BUDGET / (4 * drafts.len().max(1));
        let mut arranged: Vec<Arranged> = drafts
            .iter_mut()
            .flat_map(|draft| draft.arranged(share, &guard))
            .collect();
        arranged.sort_by_key(|arranged| arranged.plan.cost());
        let least = arranged.first().map_or(0, |arranged| arranged.plan.cost());
        arranged.retain(|arranged| 4 * arranged.plan.cost() <= CLOSE * least);
        let key = |arranged: &Arranged| {
            let plan = &arranged.plan;
            (plan.cost(), plan.len(), plan.copies())
        };
        arranged.dedup_by_key(|arranged| (arranged.draft.cost, key(arranged)));
        let mut left = FOLLOWED;
        let within = arranged.iter().take_while(|arranged| {
            let enough = arranged.plan.len() <= left;
            left = left.saturating_sub(arranged.plan.len());
            enough
        });
        let followed = within.count();
        arranged.truncate(followed.max(1));
        for Arranged {
            draft,
            plan,
            values,
        } in &mut arranged
        {
            if !draft.passes.run(Pass::Identities) {
                continue;
            }
            let accepts = |plan: &Plan| guard.accepts(plan, values);
            *plan = by_identities(std::mem::take(plan), &accepts);
        }
        let best = arranged
            .into_iter()
            .min_by_key(|arranged| (arranged.plan.cost(), arranged.plan.copies()));
        best.map_or_else(Program::default, |best| best.program(&guard))
    }

    /// The drafts that lose no digits when their operations are put in order, without expanded sines where these lose some. The first one is
    /// always among them.
    fn accepted(drafts: Vec<Self>, guard: &Guard) -> Vec<Self> {
        let mut accepted: Vec<Self> = Vec::with_capacity(drafts.len());
        for mut draft in drafts {
            let is_good = |draft: &Self| {
                let plan = arrange(&draft.graph, &draft.values, Grouping::ByLoops);
                guard.accepts(&plan, &draft.values)
            };
            let results = |first: &Self| {
                first.cleared == draft.cleared && first.block.has_the_results_of(&draft.block)
            };
            if !accepted.first().is_none_or(results) {
                continue;
            }
            let mut good = is_good(&draft);
            if !good && draft.values != draft.plain {
                draft.values.clone_from(&draft.plain);
                draft.cost = arrange(&draft.graph, &draft.values, Grouping::ByLoops).cost();
                good = is_good(&draft);
            }
            if good || accepted.is_empty() {
                accepted.push(draft);
            }
        }
        accepted
    }

    /// Takes out common factors and arranges the operations, in several ways. Without a way that loses no digits, in the order as declared.
    fn arranged(&mut self, budget: usize, guard: &Guard) -> Vec<Arranged<'_>> {
        let passes = self.passes;
        let graph = &mut self.graph;
        let take_out_factors =
            |graph: &mut Graph, values: Vec<ExprId>| match passes.run(Pass::CommonFactors) {
                true => take_out_factors(graph, values, budget),
                false => values,
            };
        let factored = take_out_factors(graph, self.values.clone());
        let mut ways = vec![(factored.clone(), Grouping::ByLoops)];
        if passes.run(Pass::Groupings) {
            ways.push((self.values.clone(), Grouping::ParametersApart));
            ways.push((factored, Grouping::VelocitiesLast));
        }
        if passes.run(Pass::MultiplyOut)
            && self.cost <= MULTIPLIED
            && self.block.inner.is_empty()
            && let Some(values) = multiplied_out(graph, &self.values)
        {
            ways.push((take_out_factors(graph, values), Grouping::ByLoops));
        }
        let by_arms = self.by_arms(budget);
        let draft: &Self = self;
        let arrange = |roots: &[ExprId], grouping| match passes.run(Pass::Distribute) {
            true => distribute(&draft.graph, roots, grouping),
            false => arrange(&draft.graph, roots, grouping),
        };
        let plans = ways.into_iter().map(|(values, grouping)| Arranged {
            draft,
            plan: arrange(&values, grouping),
            values,
        });
        let by_arms = by_arms.map(|(arms, values)| {
            let roots: Vec<ExprId> = values.iter().copied().chain(arms.parts()).collect();
            let plan = arrange(&roots, Grouping::VelocitiesLast);
            Arranged {
                draft,
                plan: arms.written_out(plan, &values),
                values,
            }
        });
        let mut all: Vec<Arranged> = plans.chain(by_arms).collect();
        all.retain(|arranged| guard.accepts(&arranged.plan, &arranged.values));
        if all.is_empty() {
            all.push(Arranged {
                draft,
                plan: arrange(&draft.values, Grouping::ByLoops),
                values: draft.values.clone(),
            });
        }
        all
    }

    /// The values by arms, with common factors taken out.
    fn by_arms(&mut self, budget: usize) -> Option<(ScaledTrig, Vec<ExprId>)> {
        let small = self.cost <= ARMED && self.block.inner.is_empty();
        if !small || !self.passes.run(Pass::ScaledTrig) {
            return None;
        }
        let (arms, values) = ScaledTrig::of(&mut self.graph, &self.values)?;
        let values = match self.passes.run(Pass::CommonFactors) {
            true => take_out_factors(&mut self.graph, values, budget),
            false => values,
        };
        Some((arms, values))
    }
}

/// The values multiplied out, but for sums whose digits that would lose; nothing where that makes too many terms.
fn multiplied_out(graph: &mut Graph, values: &[ExprId]) -> Option<Vec<ExprId>> {
    let kept: BTreeSet<ExprId> = graph
        .reachable(values)
        .into_iter()
        .filter(|id| graph.keeps_order(*id))
        .collect();
    values
        .iter()
        .map(|x| graph.expanded_around(*x, |id| kept.contains(&id)))
        .collect()
}

impl Arranged<'_> {
    fn program(self, guard: &Guard) -> Program {
        let mut next = self.values.iter();
        let mut block = self.draft.block.clone();
        block.for_each_value(&mut |value| *value = *next.next().unwrap_or(value));
        let Draft {
            passes,
            cleared,
            balances,
            ..
        } = self.draft;
        let mut plan = self.plan;
        if passes.run(Pass::CanonicalOrder) {
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
