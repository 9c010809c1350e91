//! Tables of values, and for each operation what it could be replaced by.

use super::residue::{Residue, residues};
use crate::expr::function::Function;
use crate::expr::hash::Map;
use crate::expr::input::Input;
use crate::expr::ordered::SortedMap;
use crate::optimise::plan::{Op, OpId, Plan};
use crate::optimise::rebuild::Formula;

/// The cost of an operation; in loops, by the turns that short ones have.
pub(super) fn weight(plan: &Plan, id: OpId) -> usize {
    plan.cost_of(id) << (3 * plan.loops_of(id).count_ones())
}

/// A replacement with an estimate of what it saves.
pub(super) struct Candidate {
    pub(super) saving: usize,
    pub(super) target: OpId,
    pub(super) formula: Formula,
}

/// Sums or products of two operations by their values, up to the sign.
pub(super) struct Table {
    pub(super) entries: Vec<(Residue, OpId, OpId)>,
    /// One bit for each value that there is, and for some others: small enough to stay in the cache.
    filter: Vec<u64>,
    /// By some bits of the value, the first entry.
    heads: Vec<u32>,
    /// For each entry the next one with these bits.
    next: Vec<u32>,
}

/// The number of heads and the bits of the filter, powers of two.
const HEADS: u64 = 1 << 15;
const FILTER: u64 = 1 << 18;

/// No entry.
const NONE: u32 = u32::MAX;

/// The entries of a value, in their order.
pub(super) struct Matches<'a> {
    table: &'a Table,
    size: Residue,
    at: u32,
}

impl Table {
    fn of(entries: Vec<(Residue, OpId, OpId)>) -> Self {
        let mut heads = vec![NONE; HEADS as usize];
        let mut filter = vec![0; (FILTER / 64) as usize];
        let mut next = vec![NONE; entries.len()];
        for (at, (value, ..)) in entries.iter().enumerate().rev() {
            let head = &mut heads[value.bits(HEADS - 1) as usize];
            next[at] = std::mem::replace(head, at as u32);
            let bit = value.bits(FILTER - 1);
            filter[(bit / 64) as usize] |= 1 << (bit % 64);
        }
        Self {
            entries,
            filter,
            heads,
            next,
        }
    }

    /// Whether there may be one of this value.
    pub(super) fn may_hold(&self, value: Residue) -> bool {
        let bit = value.size().bits(FILTER - 1);
        self.filter[(bit / 64) as usize] & (1 << (bit % 64)) != 0
    }

    /// All entries of a value, up to its sign.
    pub(super) fn find(&self, value: Residue) -> Matches<'_> {
        let size = value.size();
        Matches {
            table: self,
            size,
            at: self.heads[size.bits(HEADS - 1) as usize],
        }
    }
}

impl<'a> Iterator for Matches<'a> {
    type Item = &'a (Residue, OpId, OpId);

    fn next(&mut self) -> Option<Self::Item> {
        while self.at != NONE {
            let at = self.at as usize;
            let entry = &self.table.entries[at];
            self.at = self.table.next[at];
            if entry.0 == self.size {
                return Some(entry);
            }
        }
        None
    }
}

pub(super) struct Search<'a> {
    pub(super) plan: &'a Plan,
    /// Two independent values of each operation.
    pub(super) values: Vec<Residue>,
    pub(super) checks: Vec<Residue>,
    pub(super) reciprocals: Vec<Residue>,
    /// What each operation may be undefined with.
    partial: Vec<Partial>,
    leaves: Vec<Option<Leaves>>,
    pub(super) singles: Map<Residue, Vec<OpId>>,
    pub(super) products: Table,
    /// x + y and x − y
    pub(super) sums: Table,
}

impl<'a> Search<'a> {
    pub(super) fn of(plan: &'a Plan) -> Self {
        let values = residues(plan, 1);
        let mut singles: Map<Residue, Vec<OpId>> = Map::default();
        for id in plan.ids() {
            let size = values[id.index()].size();
            singles.entry(size).or_default().push(id);
        }
        let (mut products, mut sums) = (Vec::new(), Vec::new());
        for a in plan.ids() {
            for b in plan.ids().take(a.index() + 1) {
                let (x, y) = (values[a.index()], values[b.index()]);
                products.push((x.times(y).size(), a, b));
                sums.push((x.plus(y).size(), a, b));
                sums.push((x.minus(y).size(), a, b));
            }
        }
        Self {
            plan,
            checks: residues(plan, 2),
            reciprocals: values.iter().map(|value| value.reciprocal()).collect(),
            partial: partial(plan),
            leaves: leaves(plan),
            values,
            singles,
            products: Table::of(products),
            sums: Table::of(sums),
        }
    }

    /// How often each operation is used.
    pub(super) fn uses(&self) -> Vec<u32> {
        let mut uses = vec![0; self.plan.len()];
        for id in self.plan.ids() {
            for operand in self.plan.op(id).operands() {
                uses[operand.index()] += 1;
            }
        }
        for (_, value) in self.plan.values() {
            uses[value.op.index()] += 1;
        }
        uses
    }

    /// The operations that only the target needs, including itself, with the cost of each together with those that only
    /// it needs.
    pub(super) fn alone(&self, target: OpId, uses: &[u32]) -> SortedMap<OpId, usize> {
        let mut left: SortedMap<OpId, u32> = SortedMap::new();
        let mut alone = SortedMap::from([(target, weight(self.plan, target))]);
        let mut stack = vec![target];
        while let Some(id) = stack.pop() {
            for operand in self.plan.op(id).operands() {
                let left = left.get_or_insert(operand, uses[operand.index()]);
                *left -= 1;
                if *left == 0 {
                    alone.insert(operand, weight(self.plan, operand));
                    stack.push(operand);
                }
            }
        }
        alone
    }

    /// The operations that may be used in a formula for the target: they do not depend on it, and are defined wherever
    /// it is.
    pub(super) fn usable(&self, target: OpId) -> Vec<bool> {
        let mut needs = vec![false; self.plan.len()];
        needs[target.index()] = true;
        let (loops, defined) = (self.plan.loops_of(target), self.partial[target.index()]);
        let mut usable = vec![false; self.plan.len()];
        for id in self.plan.ids() {
            let at = id.index();
            let operands = self.plan.op(id).operands();
            needs[at] |= operands.iter().any(|operand| needs[operand.index()]);
            usable[at] = !needs[at]
                && self.plan.loops_of(id) & !loops == 0
                && self.partial[at].needs & !defined.falls_with == 0
                && !self.values[at].is_zero();
        }
        usable
    }

    /// Whether a moving input is added to something else before it is combined with another moving one: (x − y) − c may
    /// cancel before a digit is rounded away, (x − c) − y may not, and with larger terms no sample state would show it.
    pub(super) fn parts_what_moves(&self, formula: &Formula) -> bool {
        let Formula::Sum(terms) = formula else {
            return false;
        };
        let [a, b] = &**terms;
        let parted = match (self.leaves_of(a), self.leaves_of(b)) {
            (Some(a), Some(b)) => a.moving && b.moving && (a.resting || b.resting),
            _ => false,
        };
        parted || self.parts_what_moves(a) || self.parts_what_moves(b)
    }

    fn leaves_of(&self, formula: &Formula) -> Option<Leaves> {
        match formula {
            Formula::Is(value) => self.leaves[value.op.index()],
            Formula::Sum(terms) => {
                let [a, b] = &**terms;
                Some(self.leaves_of(a)?.and(self.leaves_of(b)?))
            }
            Formula::Product(_) => None,
        }
    }

    pub(super) fn check(&self, formula: &Formula) -> Residue {
        match formula {
            Formula::Is(value) => {
                let own = self.checks[value.op.index()];
                if value.negative { own.opposite() } else { own }
            }
            Formula::Sum(parts) => self.check(&parts[0]).plus(self.check(&parts[1])),
            Formula::Product(parts) => self.check(&parts[0]).times(self.check(&parts[1])),
        }
    }
}

/// What stands in a sum of inputs and numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Leaves {
    /// Coordinates and their rates.
    moving: bool,
    /// Parameters and numbers.
    resting: bool,
}

impl Leaves {
    fn and(self, other: Self) -> Self {
        Self {
            moving: self.moving || other.moving,
            resting: self.resting || other.resting,
        }
    }
}

/// The operations that are inputs, numbers, or sums of these.
fn leaves(plan: &Plan) -> Vec<Option<Leaves>> {
    let mut all: Vec<Option<Leaves>> = Vec::with_capacity(plan.len());
    for id in plan.ids() {
        let of = |x: &OpId| all[x.index()];
        let own = match plan.op(id) {
            Op::Input(input) => {
                let resting = matches!(
                    input,
                    Input::Parameter(_) | Input::ParameterElement(..) | Input::Integer(_)
                );
                Some(Leaves {
                    moving: !resting,
                    resting,
                })
            }
            Op::Constant(_) => Some(Leaves {
                resting: true,
                ..Leaves::default()
            }),
            Op::Negate(a) => of(a),
            Op::Add(a, b) | Op::Subtract(a, b) => of(a).zip(of(b)).map(|(a, b)| a.and(b)),
            _ => None,
        };
        all.push(own);
    }
    all
}

/// Operations that are not defined, or not smooth, everywhere: one bit for each; all past the last but one share one.
#[derive(Clone, Copy, Default)]
struct Partial {
    /// Those that an operation is computed from.
    needs: u128,
    /// Those with which it is infinite or not a number. Others are kept from it: by a choice, or as 1/x is from e^(−1/|x|), which is zero at
    /// x = 0.
    falls_with: u128,
}

fn partial(plan: &Plan) -> Vec<Partial> {
    let mut all: Vec<Partial> = Vec::with_capacity(plan.len());
    let mut next = 0;
    for id in plan.ids() {
        let op = plan.op(id);
        let of = |x: &OpId| all[x.index()];
        let mut own = Partial::default();
        for x in op.operands() {
            own.needs |= of(&x).needs;
        }
        own.falls_with = match op {
            Op::Select {
                then, otherwise, ..
            } => of(then).falls_with & of(otherwise).falls_with,
            Op::Divide(above, _) => of(above).falls_with,
            Op::IntegerPower(x, n) if *n > 0 => of(x).falls_with,
            Op::Power(..) | Op::IntegerPower(..) | Op::Loop { .. } => 0,
            Op::Call(function, _) if !keeps_infinity(*function) => 0,
            op => {
                let operands = op.operands().into_iter();
                operands.fold(0, |all, x| all | of(&x).falls_with)
            }
        };
        let whole = match op {
            Op::Divide(..) | Op::Power(..) | Op::Select { .. } | Op::Loop { .. } => false,
            Op::IntegerPower(_, n) => *n >= 0,
            Op::Call(function, _) => function.is_smooth_everywhere(),
            _ => true,
        };
        if !whole {
            own.needs |= 1 << next;
            own.falls_with |= 1 << next;
            next = (next + 1).min(u128::BITS - 1);
        }
        all.push(own);
    }
    all
}

/// Whether f(±∞) is infinite or not a number.
fn keeps_infinity(function: Function) -> bool {
    !matches!(
        function,
        Function::Exp
            | Function::Atan
            | Function::Atan2
            | Function::Tanh
            | Function::Sign
            | Function::Min
            | Function::Max
    )
}
