//! From entries to a program: several ways to write the same results, of which the cheapest is scheduled.

use std::collections::BTreeSet;

use crate::derive::entry::{Array, Entry};
use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph};
use crate::optimise::angles::expand_angles;
use crate::optimise::binarize::{Grouping, arrange};
use crate::optimise::canonical_order::with_like_operations_alike;
use crate::optimise::distribute::distribute;
use crate::optimise::factor::{BUDGET, take_out_factors};
use crate::optimise::identities::by_identities;
use crate::optimise::plan::Plan;
use crate::optimise::scaled_trig::ScaledTrig;
use crate::optimise::signs::with_fewer_negations;
use crate::program::Program;
use crate::schedule::balance::{Balance, balances};
use crate::schedule::loop_nest::Block;
use crate::schedule::statements::schedule;
use crate::schedule::store_or_add::settle;

/// Of the drafts, those that cost no more than so many fifths of the cheapest are followed: identities may change their order.
const WITHIN: usize = 6;

/// Drafts up to this cost are also multiplied out before common factors are sought.
const MULTIPLIED: usize = 110;

/// Drafts up to this cost are also written by arms.
const ARMED: usize = 600;

/// Identities are sought in the cheapest plans, where they cost no more than so many quarters of the cheapest, up to so many operations
/// altogether.
const CLOSE: usize = 6;
const FOLLOWED: usize = 240;

/// Entries in their loops, before common factors are sought.
pub(crate) struct Draft {
    graph: Graph,
    cleared: BTreeSet<Array>,
    block: Block,
    balances: Vec<Balance>,
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
    pub(crate) fn of(mut graph: Graph, mut entries: Vec<Entry>) -> Self {
        let balances = balances(&mut graph, &mut entries);
        let values: Vec<ExprId> = entries.iter().map(|entry| entry.value).collect();
        let values = graph.open_single_sums(&values);
        let entries = entries
            .into_iter()
            .zip(values)
            .map(|(entry, value)| Entry { value, ..entry })
            .collect();
        let mut block = Block::of(&mut graph, entries);
        let zero = graph.constant(Constant::ZERO);
        let cleared = settle(&mut block, zero);
        let mut values = Vec::new();
        block.for_each_value(&mut |value| values.push(*value));
        let values = expand_angles(&mut graph, values);
        let cost = arrange(&graph, &values, Grouping::ByLoops).cost();
        Self {
            graph,
            cleared,
            block,
            balances,
            values,
            cost,
        }
    }

    /// The program of the cheapest of them; of equal ones the first.
    pub(crate) fn best(mut drafts: Vec<Self>) -> Program {
        drafts.sort_by_key(|draft| draft.cost);
        let least = drafts.first().map_or(0, |draft| draft.cost);
        drafts.retain(|draft| 5 * draft.cost <= WITHIN * least);
        drafts.dedup_by_key(|draft| draft.cost);
        let share = BUDGET / (4 * drafts.len().max(1));
        let mut arranged: Vec<Arranged> = drafts
            .iter_mut()
            .flat_map(|draft| draft.arranged(share))
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
        for Arranged { plan, .. } in &mut arranged {
            *plan = by_identities(std::mem::take(plan));
        }
        let best = arranged
            .into_iter()
            .min_by_key(|arranged| (arranged.plan.cost(), arranged.plan.copies()));
        best.map_or_else(Program::default, Arranged::program)
    }

    /// Takes out common factors and arranges the operations, in several ways.
    fn arranged(&mut self, budget: usize) -> Vec<Arranged<'_>> {
        let graph = &mut self.graph;
        let factored = take_out_factors(graph, self.values.clone(), budget);
        let mut ways = vec![
            (factored.clone(), Grouping::ByLoops),
            (self.values.clone(), Grouping::ParametersApart),
            (factored, Grouping::VelocitiesLast),
        ];
        if self.cost <= MULTIPLIED && self.block.inner.is_empty() {
            let values: Option<Vec<ExprId>> =
                self.values.iter().map(|x| graph.expanded(*x)).collect();
            if let Some(values) = values {
                ways.push((take_out_factors(graph, values, budget), Grouping::ByLoops));
            }
        }
        let by_arms = self.by_arms(budget);
        let draft: &Self = self;
        let plans = ways.into_iter().map(|(values, grouping)| Arranged {
            draft,
            plan: distribute(&draft.graph, &values, grouping),
            values,
        });
        let by_arms = by_arms.map(|(arms, values)| {
            let roots: Vec<ExprId> = values.iter().copied().chain(arms.parts()).collect();
            let plan = distribute(&draft.graph, &roots, Grouping::VelocitiesLast);
            Arranged {
                draft,
                plan: arms.written_out(plan, &values),
                values,
            }
        });
        plans.chain(by_arms).collect()
    }

    /// The values by arms, with common factors taken out.
    fn by_arms(&mut self, budget: usize) -> Option<(ScaledTrig, Vec<ExprId>)> {
        if self.cost > ARMED || !self.block.inner.is_empty() {
            return None;
        }
        let (arms, values) = ScaledTrig::of(&mut self.graph, &self.values)?;
        Some((arms, take_out_factors(&mut self.graph, values, budget)))
    }
}

impl Arranged<'_> {
    fn program(self) -> Program {
        let mut next = self.values.iter();
        let mut block = self.draft.block.clone();
        block.for_each_value(&mut |value| *value = *next.next().unwrap_or(value));
        let plan = with_like_operations_alike(self.plan);
        let plan = with_fewer_negations(plan, &block.stored());
        schedule(plan, &self.draft.cleared, &block, &self.draft.balances)
    }
}
