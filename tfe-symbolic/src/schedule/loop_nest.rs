//! The results of a program in nested loops: where each is written, and what is kept in variables in between.
//!
//! Results are in memory, and a compiler cannot know that `E_q[i]` and `E_q[j]` are two places. So values that need not
//! go through memory on every turn become running sums: contributions of an inner loop to a place that does not depend
//! on it, and, where a loop adds to the places i and i + 1, the part of i + 1 that the next turn completes.

use crate::derive::entry::Entry;
use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph, SumRange};
use crate::expr::input::{Affine, IndexSymbol};
use crate::expr::ordered::{SortedMap, SortedSet};
use crate::program::Place;

/// `Σ c x`
type Terms = Vec<(Constant, ExprId)>;

/// A variable that loops change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Local(pub(crate) usize);

/// What is computed at one level of nesting, and the loops inside.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    /// The variables that the loops inside change, with what they begin with, if it is not zero.
    pub(crate) locals: Vec<(Local, Option<ExprId>)>,
    /// Results before the loops.
    pub(crate) sinks: Vec<Sink>,
    /// The loops at this level.
    pub(crate) inner: Vec<(SumRange, Block)>,
    /// Results after the loops.
    pub(crate) after: Vec<Sink>,
}

/// A result: the variable and the value, added.
#[derive(Clone, Debug)]
pub(crate) struct Sink {
    /// Where it goes.
    pub(crate) target: Target,
    /// A variable.
    pub(crate) local: Option<Local>,
    /// An expression; several of equal value are computed once.
    pub(crate) value: Option<ExprId>,
}

/// Where a result goes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Target {
    /// Into the results.
    Store {
        /// Where to.
        place: Place,
        /// Onto what is there.
        accumulate: bool,
    },
    /// Onto a variable.
    Add(Local),
    /// Into a variable, for the next turn.
    Set(Local),
}

impl Sink {
    /// A result that is stored.
    pub(crate) fn store(place: Place, local: Option<Local>, value: Option<ExprId>) -> Self {
        let target = Target::Store {
            place,
            accumulate: false,
        };
        Self {
            target,
            local,
            value,
        }
    }

    /// Where it is stored.
    pub(crate) fn place(&self) -> Option<&Place> {
        match &self.target {
            Target::Store { place, .. } => Some(place),
            Target::Add(_) | Target::Set(_) => None,
        }
    }
}

impl Block {
    /// Orders entries into nested loops.
    pub(crate) fn of(graph: &mut Graph, entries: Vec<Entry>) -> Self {
        // Outer loops come before those inside of them.
        let mut merged: SortedMap<(Vec<SumRange>, Place), Terms> = SortedMap::new();
        for Entry { nest, place, value } in entries {
            merged
                .get_or_default((nest, place))
                .push((Constant::ONE, value));
        }
        let mut root = Self::default();
        let mut locals = Locals::default();
        for ((nest, place), values) in merged {
            let value = graph.linear(Constant::ZERO, &values);
            root.insert(&nest, place, value, &mut locals);
        }
        root.carry(&mut locals, graph.ranges_are_checked);
        root
    }

    /// Visits all values, in the order of the program.
    pub(crate) fn for_each_value(&mut self, visit: &mut dyn FnMut(&mut ExprId)) {
        let before = self
            .locals
            .iter_mut()
            .filter_map(|(_, start)| start.as_mut());
        before.for_each(&mut *visit);
        let values = |sinks: &mut Vec<Sink>, visit: &mut dyn FnMut(&mut ExprId)| {
            let values = sinks.iter_mut().filter_map(|sink| sink.value.as_mut());
            values.for_each(visit);
        };
        values(&mut self.sinks, visit);
        for (_, inner) in &mut self.inner {
            inner.for_each_value(visit);
        }
        values(&mut self.after, visit);
    }

    /// Whether the other one has the same results in the same loops, computed from any expressions.
    pub(crate) fn has_the_results_of(&self, other: &Self) -> bool {
        let local = |(local, start): &(Local, Option<ExprId>)| (*local, start.is_some());
        let sinks = |one: &[Sink], other: &[Sink]| {
            let same = |(one, other): (&Sink, &Sink)| {
                one.target == other.target
                    && one.local == other.local
                    && one.value.is_some() == other.value.is_some()
            };
            one.len() == other.len() && one.iter().zip(other).all(same)
        };
        let inner =
            |((range, block), (other_range, other)): (&(SumRange, Self), &(SumRange, Self))| {
                range == other_range && block.has_the_results_of(other)
            };
        self.locals
            .iter()
            .map(local)
            .eq(other.locals.iter().map(local))
            && sinks(&self.sinks, &other.sinks)
            && sinks(&self.after, &other.after)
            && self.inner.len() == other.inner.len()
            && self.inner.iter().zip(&other.inner).all(inner)
    }

    /// The values whose sign matters: a value that is added to a variable may as well be subtracted.
    pub(crate) fn stored(&self) -> SortedSet<ExprId> {
        let starts = self.locals.iter().filter_map(|(_, start)| *start);
        let adds = |sink: &&Sink| matches!(sink.target, Target::Add(_)) || sink.local.is_some();
        let sinks = self.sinks.iter().chain(&self.after);
        let stored = sinks
            .filter(|sink| !adds(sink))
            .filter_map(|sink| sink.value);
        let inner = self.inner.iter().flat_map(|(_, inner)| inner.stored());
        starts.chain(stored).chain(inner).collect()
    }

    /// The block inside of these loops.
    fn inside(&mut self, nest: &[SumRange]) -> &mut Self {
        let mut block = self;
        for range in nest {
            let known = block.inner.iter().position(|(known, _)| known == range);
            let at = known.unwrap_or_else(|| {
                block.inner.push((range.clone(), Self::default()));
                block.inner.len() - 1
            });
            block = &mut block.inner[at].1;
        }
        block
    }

    /// Adds an entry; if the innermost loops do not move its place, by a running sum outside of them.
    fn insert(&mut self, nest: &[SumRange], place: Place, value: ExprId, locals: &mut Locals) {
        let moving = |range: &SumRange| place.depends_on(range.variable);
        let depth = nest.iter().rposition(moving).map_or(0, |last| last + 1);
        let outer = self.inside(&nest[..depth]);
        if depth == nest.len() {
            outer.sinks.push(Sink::store(place, None, Some(value)));
            return;
        }
        let known = outer.after.iter().find(|sink| sink.place() == Some(&place));
        let local = match known.and_then(|sink| sink.local) {
            Some(local) => local,
            None => {
                let local = locals.next();
                let start = outer.take(&place);
                outer.locals.push((local, start));
                outer.after.push(Sink::store(place, Some(local), None));
                local
            }
        };
        outer.inside(&nest[depth..]).sinks.push(Sink {
            target: Target::Add(local),
            local: None,
            value: Some(value),
        });
    }

    /// Takes the value of a place out of the results before the loops.
    fn take(&mut self, place: &Place) -> Option<ExprId> {
        let plain = |sink: &Sink| sink.local.is_none() && sink.place() == Some(place);
        let at = self.sinks.iter().position(plain)?;
        self.sinks.remove(at).value
    }

    /// Keeps contributions of a loop to the places of its next turns in variables.
    fn carry(&mut self, locals: &mut Locals, checked: bool) {
        for at in 0..self.inner.len() {
            let (range, inner) = &mut self.inner[at];
            inner.carry(locals, checked);
            // If the range ended below its start, the variables of its loop would be stored at the places of others. An empty
            // one ends where it starts, so that they are stored where they came from.
            let bounds = range.start.as_constant().zip(range.end.as_constant());
            let is_known = bounds.is_some_and(|(start, end)| start < end);
            let is_checked = checked && is_of_fields(&range.start) && is_of_fields(&range.end);
            if !(is_known || is_checked) {
                continue;
            }
            let range = range.clone();
            for chain in inner.chains(&range) {
                self.carry_chain(at, &range, &chain, locals);
            }
        }
    }

    /// The results of a loop at the places i, i + 1, …, each chain of at least two.
    fn chains(&self, range: &SumRange) -> Vec<Vec<Place>> {
        let next = |place: &Place| moved(place, range, 1);
        let places: Vec<&Place> = self.sinks.iter().filter_map(Sink::place).collect();
        let moving = places
            .iter()
            .copied()
            .filter(|place| place.depends_on(range.variable));
        let first = moving.filter(|place| !places.iter().any(|other| next(other) == **place));
        let chain = |first: &Place| {
            let mut chain = vec![first.clone()];
            while let Some(place) = chain
                .last()
                .map(next)
                .filter(|place| places.contains(&place))
            {
                chain.push(place);
            }
            chain
        };
        first.map(chain).filter(|chain| chain.len() > 1).collect()
    }

    /// On each turn the first place of the chain is complete: it is the sum of the present contribution and what was
    /// kept from earlier turns.
    fn carry_chain(&mut self, at: usize, range: &SumRange, chain: &[Place], locals: &mut Locals) {
        let kept: Vec<Local> = chain[1..].iter().map(|_| locals.next()).collect();
        let first = &chain[0];
        let end = |steps: usize| Affine {
            constant: range.end.constant.saturating_add(steps as i64),
            ..range.end.clone()
        };
        let start = |steps: usize| Affine {
            constant: range.start.constant.saturating_add(steps as i64),
            ..range.start.clone()
        };
        let starts: Vec<(Local, Option<ExprId>)> = kept
            .iter()
            .enumerate()
            .map(|(k, local)| (*local, self.take(&first.at(range.variable, &start(k)))))
            .collect();
        self.locals.extend(starts);
        let inner = &mut self.inner[at].1;
        let values: Vec<Option<ExprId>> = chain.iter().map(|place| inner.take(place)).collect();
        for (k, value) in values.into_iter().enumerate() {
            let local = kept.get(k).copied();
            inner.sinks.push(match k.checked_sub(1) {
                None => Sink::store(first.clone(), local, value),
                Some(own) => Sink {
                    target: Target::Set(kept[own]),
                    local,
                    value,
                },
            });
        }
        for (k, local) in kept.into_iter().enumerate() {
            let place = first.at(range.variable, &end(k));
            let value = self.take(&place);
            self.after.push(Sink::store(place, Some(local), value));
        }
    }
}

/// Whether a bound is the same on all turns of all loops, and known at run time.
fn is_of_fields(bound: &Affine) -> bool {
    let field = |(symbol, _): &(IndexSymbol, i64)| matches!(symbol, IndexSymbol::Field(_));
    bound.terms.iter().all(field)
}

/// The place some turns later.
fn moved(place: &Place, range: &SumRange, turns: i64) -> Place {
    let mut later = Affine::symbol(IndexSymbol::Loop(range.variable));
    later.constant = turns;
    place.at(range.variable, &later)
}

/// How many variables there are.
#[derive(Default)]
struct Locals(usize);

impl Locals {
    fn next(&mut self) -> Local {
        self.0 += 1;
        Local(self.0 - 1)
    }
}
