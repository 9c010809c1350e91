//! From entries to a program: several ways to write the same results, of which the cheapest is scheduled.

use std::collections::BTreeSet;

use crate::angles::expand_angles;
use crate::arrange::arrange;
use crate::blocks::Block;
use crate::constant::Constant;
use crate::distribute::distribute;
use crate::entry::{Array, Entry};
use crate::factor::take_out_factors;
use crate::graph::{ExprId, Graph};
use crate::plan::Plan;
use crate::program::Program;
use crate::schedule::schedule;
use crate::writes::settle;

/// Of the drafts, those within this part of the cheapest are followed, and no more than so many: the search for common factors costs most of
/// the time, and seldom changes their order.
const WITHIN: usize = 32;
const FOLLOWED: usize = 2;

/// Entries in their loops, before common factors are sought.
pub(crate) struct Draft {
    graph: Graph,
    cleared: BTreeSet<Array>,
    block: Block,
    values: Vec<ExprId>,
    cost: usize,
}

impl Draft {
    /// Puts entries into loops and expands sines of sums.
    pub(crate) fn of(mut graph: Graph, entries: Vec<Entry>) -> Self {
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
        let cost = arrange(&graph, &values).cost();
        Self {
            graph,
            cleared,
            block,
            values,
            cost,
        }
    }

    /// The program of the cheapest of them; of equal ones the first.
    pub(crate) fn best(mut drafts: Vec<Self>) -> Program {
        drafts.sort_by_key(|draft| draft.cost);
        let least = drafts.first().map_or(0, |draft| draft.cost);
        drafts.retain(|draft| draft.cost <= least + least / WITHIN);
        drafts.dedup_by_key(|draft| draft.cost);
        drafts.truncate(FOLLOWED);
        let finished = drafts.into_iter().map(Self::finish);
        let best = finished.min_by_key(|(plan, ..)| plan.cost());
        best.map_or_else(Program::default, |(plan, cleared, block)| {
            schedule(plan, &cleared, &block)
        })
    }

    /// Takes out common factors and arranges the operations.
    fn finish(mut self) -> (Plan, BTreeSet<Array>, Block) {
        let values = take_out_factors(&mut self.graph, self.values);
        let mut next = values.iter();
        let mut block = self.block;
        block.for_each_value(&mut |value| *value = *next.next().unwrap_or(value));
        (distribute(&self.graph, &values), self.cleared, block)
    }
}
