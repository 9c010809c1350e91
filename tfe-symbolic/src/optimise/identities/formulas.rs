//! The formulas that give one operation, from short ones to long ones.

use super::residue::Residue;
use super::search::{Candidate, Search};
use crate::expr::ordered::SortedMap;
use crate::expr::sorting::sort_by_key;
use crate::optimise::plan::{OpId, Value};
use crate::optimise::rebuild::Formula;
use crate::program::cost;

/// How many formulas for one operation are kept.
const KEPT: usize = 4;

impl Search<'_> {
    /// The replacements that seem to save most, the best first.
    pub(super) fn candidates(&self) -> Vec<Candidate> {
        let mut all: Vec<Candidate> = Vec::new();
        let uses = self.uses();
        for target in self.plan.ids() {
            if self.plan.cost_of(target) == 0 || self.values[target.index()].is_zero() {
                continue;
            }
            let mut own = self.formulas(target, &uses);
            sort_by_key(&mut own, |candidate| std::cmp::Reverse(candidate.saving));
            own.truncate(KEPT);
            all.append(&mut own);
        }
        sort_by_key(&mut all, |candidate| std::cmp::Reverse(candidate.saving));
        all
    }

    /// Formulas for one operation that may save something.
    fn formulas(&self, target: OpId, uses: &[u32]) -> Vec<Candidate> {
        let alone = self.alone(target, uses);
        let total: usize = alone.values().sum();
        let unit = cost::ADDITION << (3 * self.plan.loops_of(target).count_ones());
        let mut found = Found {
            search: self,
            target,
            alone: &alone,
            total,
            unit,
            usable: self.usable(target),
            candidates: Vec::new(),
        };
        found.one();
        if total > unit {
            found.two();
        }
        if total > 2 * unit {
            found.three();
        }
        if total > 3 * unit {
            found.four();
        }
        found.candidates
    }
}

/// The formulas found for one operation.
pub(super) struct Found<'a> {
    pub(super) search: &'a Search<'a>,
    pub(super) target: OpId,
    pub(super) alone: &'a SortedMap<OpId, usize>,
    pub(super) total: usize,
    pub(super) unit: usize,
    pub(super) usable: Vec<bool>,
    pub(super) candidates: Vec<Candidate>,
}

fn is(op: OpId, negative: bool) -> Formula {
    Formula::Is(Value { negative, op })
}

impl Found<'_> {
    fn value(&self, id: OpId) -> Residue {
        self.search.values[id.index()]
    }

    fn goal(&self) -> Residue {
        self.value(self.target)
    }

    fn operands(&self) -> Vec<OpId> {
        let ids = self.search.plan.ids();
        ids.filter(|id| self.usable[id.index()]).collect()
    }

    /// Notes a formula of so many operations.
    fn note(&mut self, formula: Formula, operations: usize) {
        let operands = formula.operands();
        if !operands.iter().all(|id| self.usable[id.index()]) {
            return;
        }
        let Some(most) = self.total.checked_sub(operations * self.unit) else {
            return;
        };
        let saving = most.saturating_sub(self.kept(operands));
        if saving > 0
            && !self.search.parts_what_moves(&formula)
            && self.search.check(&formula) == self.search.checks[self.target.index()]
        {
            self.candidates.push(Candidate {
                saving,
                target: self.target,
                formula,
            });
        }
    }

    /// What stays of the operations that only the target needs.
    fn kept(&self, mut stack: Vec<OpId>) -> usize {
        let mut seen = Vec::new();
        let mut kept = 0;
        while let Some(id) = stack.pop() {
            if let Some(cost) = self.alone.get(&id)
                && !seen.contains(&id)
            {
                kept += cost;
                seen.push(id);
                stack.extend(self.search.plan.op(id).operands());
            }
        }
        kept
    }

    /// x
    pub(super) fn one(&mut self) {
        let search = self.search;
        for id in search
            .singles
            .get(&self.goal().size())
            .map_or(&[][..], |all| all)
        {
            self.note(is(*id, self.value(*id) != self.goal()), 0);
        }
    }

    /// x ± y, x y
    pub(super) fn two(&mut self) {
        let search = self.search;
        let single = |value: Residue| {
            let known = search.singles.get(&value.size());
            known.map_or(&[][..], |all| all)
        };
        for x in self.operands() {
            for negative in [false, true] {
                let rest = self.rest(x, negative);
                for y in single(rest) {
                    let y = is(*y, self.value(*y) != rest);
                    self.note(Formula::sum(is(x, negative), y), 1);
                }
            }
            let rest = self.quotient(x);
            for y in single(rest) {
                let y = is(*y, self.value(*y) != rest);
                self.note(Formula::product(is(x, false), y), 1);
            }
        }
    }

    /// goal ∓ x
    fn rest(&self, x: OpId, negative: bool) -> Residue {
        if negative {
            self.goal().plus(self.value(x))
        } else {
            self.goal().minus(self.value(x))
        }
    }

    /// goal / x
    fn quotient(&self, x: OpId) -> Residue {
        self.goal().times(self.search.reciprocals[x.index()])
    }

    /// x ± y z, x (y ± z), x y z, x ± y ± z
    pub(super) fn three(&mut self) {
        let search = self.search;
        for x in self.operands() {
            for negative in [false, true] {
                let rest = self.rest(x, negative);
                for (_, y, z) in search.products.find(rest) {
                    let product = self.product_of(*y, *z, rest);
                    self.note(Formula::sum(is(x, negative), product), 2);
                }
                for (_, y, z) in search.sums.find(rest) {
                    if let Some(sum) = self.sum_of(*y, *z, rest) {
                        self.note(Formula::sum(is(x, negative), sum), 2);
                    }
                }
            }
            let rest = self.quotient(x);
            for (_, y, z) in search.sums.find(rest) {
                if let Some(sum) = self.sum_of(*y, *z, rest) {
                    self.note(Formula::product(is(x, false), sum), 2);
                }
            }
            for (_, y, z) in search.products.find(rest) {
                let product = self.product_of(*y, *z, rest);
                self.note(Formula::product(is(x, false), product), 2);
            }
        }
    }

    /// y z or −y z, whichever has this value.
    fn product_of(&self, y: OpId, z: OpId, value: Residue) -> Formula {
        let negative = self.value(y).times(self.value(z)) != value;
        Formula::product(is(y, negative), is(z, false))
    }

    /// ±y ± z of this value.
    fn sum_of(&self, y: OpId, z: OpId, value: Residue) -> Option<Formula> {
        let signs = [(false, false), (false, true), (true, false), (true, true)];
        let signed = |id: OpId, negative: bool| {
            let own = self.value(id);
            if negative { own.opposite() } else { own }
        };
        let matching = signs
            .into_iter()
            .find(|(a, b)| signed(y, *a).plus(signed(z, *b)) == value);
        matching.map(|(a, b)| Formula::sum(is(y, a), is(z, b)))
    }

    /// x y ± z w, x (y ± z w), x ± y (z ± w)
    pub(super) fn four(&mut self) {
        let search = self.search;
        let goal = self.goal();
        for (size, x, y) in &search.products.entries {
            if self.usable[x.index()] && self.usable[y.index()] {
                self.two_products((*x, *y), *size, goal.minus(*size));
                self.two_products((*x, *y), size.opposite(), goal.plus(*size));
            }
        }
        let operands: Vec<(OpId, Residue)> = self
            .operands()
            .into_iter()
            .map(|id| (id, self.value(id)))
            .collect();
        for (x, _) in &operands {
            let reciprocal = search.reciprocals[x.index()];
            let quotient = goal.times(reciprocal);
            for (y, value) in &operands {
                self.times_sum(*x, (*y, false), quotient.minus(*value));
                self.times_sum(*x, (*y, true), quotient.plus(*value));
                let (rest, other) = (goal.minus(*value), goal.plus(*value));
                self.plus_product((*y, false), *x, rest.times(reciprocal));
                self.plus_product((*y, true), *x, other.times(reciprocal));
            }
        }
    }

    /// x y, which is `product` up to its sign, ± z w = rest
    fn two_products(&mut self, (x, y): (OpId, OpId), product: Residue, rest: Residue) {
        if !self.search.products.may_hold(rest) {
            return;
        }
        for (_, z, w) in self.search.products.find(rest) {
            let first = self.product_of(x, y, product);
            let second = self.product_of(*z, *w, rest);
            self.note(Formula::sum(first, second), 3);
        }
    }

    /// x (y ± z w), the product being `rest`
    fn times_sum(&mut self, x: OpId, (y, negative): (OpId, bool), rest: Residue) {
        if !self.search.products.may_hold(rest) {
            return;
        }
        for (_, z, w) in self.search.products.find(rest) {
            let inner = Formula::sum(is(y, negative), self.product_of(*z, *w, rest));
            self.note(Formula::product(is(x, false), inner), 3);
        }
    }

    /// y ± x (z ± w), the sum being `inner`
    fn plus_product(&mut self, (y, negative): (OpId, bool), x: OpId, inner: Residue) {
        if !self.search.sums.may_hold(inner) {
            return;
        }
        for (_, z, w) in self.search.sums.find(inner) {
            if let Some(sum) = self.sum_of(*z, *w, inner) {
                let product = Formula::product(is(x, false), sum);
                self.note(Formula::sum(is(y, negative), product), 3);
            }
        }
    }
}
