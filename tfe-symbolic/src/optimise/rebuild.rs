//! Rebuilds plans from the operations that their roots need, with some operations replaced and some differences
//! reversed.

use crate::expr::constant::Constant;
use crate::expr::hash::Map;
use crate::expr::ordered::SortedSet;
use crate::expr::sorting::sort_by_key;
use crate::optimise::plan::{Op, OpId, Plan, Value};

/// An expression in place of an operation, of operations of the same plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Formula {
    /// An operation, or its negative.
    Is(Value),
    /// The sum.
    Sum(Box<[Self; 2]>),
    /// The product.
    Product(Box<[Self; 2]>),
}

impl Formula {
    /// a + b
    pub(crate) fn sum(a: Self, b: Self) -> Self {
        Self::Sum(Box::new([a, b]))
    }

    /// a b
    pub(crate) fn product(a: Self, b: Self) -> Self {
        Self::Product(Box::new([a, b]))
    }

    /// The operations in it.
    pub(crate) fn operands(&self) -> Vec<OpId> {
        match self {
            Self::Is(value) => vec![value.op],
            Self::Sum(parts) | Self::Product(parts) => {
                parts.iter().flat_map(Self::operands).collect()
            }
        }
    }
}

/// The changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Changes {
    /// The formulas that replace these operations. No formula may need what it replaces.
    pub(crate) formulas: Map<OpId, Formula>,
    /// Differences a − b that are computed as −(b − a).
    pub(crate) turned: SortedSet<OpId>,
}

/// A plan with the changes made, of what its roots need and nothing else; and what each operation has become.
pub(crate) fn rebuild(old: &Plan, changes: &Changes) -> (Plan, Map<OpId, Value>) {
    let mut rebuilder = Rebuilder {
        old,
        changes,
        new: Plan::default(),
        built: Map::default(),
    };
    let mut roots: Vec<_> = old.values().collect();
    // In the order in which they were made: the same plan on every run.
    sort_by_key(&mut roots, |(_, value)| value.op);
    for (root, value) in roots {
        let built = rebuilder.value(value);
        rebuilder.new.set_value(root, built);
    }
    (rebuilder.new, rebuilder.built)
}

struct Rebuilder<'a> {
    old: &'a Plan,
    changes: &'a Changes,
    new: Plan,
    built: Map<OpId, Value>,
}

impl Rebuilder<'_> {
    fn value(&mut self, value: Value) -> Value {
        let mut stack = vec![value.op];
        while let Some(&top) = stack.last() {
            if self.built.contains_key(&top) {
                stack.pop();
                continue;
            }
            let before = stack.len();
            let needed = match self.changes.formulas.get(&top) {
                Some(formula) => formula.operands(),
                None => self.old.op(top).operands(),
            };
            let missing = needed.into_iter().rev();
            stack.extend(missing.filter(|id| !self.built.contains_key(id)));
            if stack.len() == before {
                let built = match self.changes.formulas.get(&top) {
                    Some(formula) => self.formula(formula),
                    None => self.operation(top),
                };
                self.built.insert(top, built);
                stack.pop();
            }
        }
        self.known(value)
    }

    fn known(&self, value: Value) -> Value {
        let built = self.built[&value.op];
        Value {
            negative: built.negative != value.negative,
            op: built.op,
        }
    }

    /// Formulas are as deep as people nest them.
    fn formula(&mut self, formula: &Formula) -> Value {
        match formula {
            Formula::Is(value) => self.known(*value),
            Formula::Sum(parts) => {
                let [a, b] = [&parts[0], &parts[1]].map(|part| self.formula(part));
                self.new.add(a, b)
            }
            Formula::Product(parts) => {
                let [a, b] = [&parts[0], &parts[1]].map(|part| self.formula(part));
                self.new.multiply(a, b)
            }
        }
    }

    fn operation(&mut self, id: OpId) -> Value {
        let positive = |op| Value {
            negative: false,
            op,
        };
        let opposite = |value: Value| Value {
            negative: !value.negative,
            op: value.op,
        };
        let op = self.old.op(id).clone();
        let of = |id: &OpId| self.built[id];
        match &op {
            Op::Add(a, b) => {
                let (a, b) = (of(a), of(b));
                self.sum(id, a, b)
            }
            Op::Subtract(a, b) => {
                let (a, b) = (of(a), opposite(of(b)));
                self.sum(id, a, b)
            }
            Op::Multiply(a, b) => {
                let (a, b) = (of(a), of(b));
                self.new.multiply(a, b)
            }
            Op::Divide(a, b) => {
                let (a, b) = (of(a), of(b));
                let op = self.new.push(Op::Divide(a.op, b.op));
                Value {
                    negative: a.negative != b.negative,
                    op,
                }
            }
            Op::Negate(a) => opposite(of(a)),
            Op::Loop { range, body } => {
                let body = of(body);
                let op = self.new.push(Op::Loop {
                    range: range.clone(),
                    body: body.op,
                });
                Value {
                    negative: body.negative,
                    op,
                }
            }
            Op::Constant(value) if value.is_negative() => {
                opposite(positive(self.new.push(Op::Constant(-*value))))
            }
            Op::Constant(_) | Op::Input(_) => positive(self.new.push(op)),
            other => {
                let mut plain = |id: &OpId| {
                    let value = self.built[id];
                    self.new.plain(value)
                };
                let op = match other {
                    Op::Call(function, arguments) => {
                        Op::Call(*function, arguments.iter().map(plain).collect())
                    }
                    Op::Select {
                        comparison,
                        left,
                        right,
                        then,
                        otherwise,
                    } => Op::Select {
                        comparison: *comparison,
                        left: plain(left),
                        right: plain(right),
                        then: plain(then),
                        otherwise: plain(otherwise),
                    },
                    Op::IntegerPower(a, n) => Op::IntegerPower(plain(a), *n),
                    Op::Power(a, b) => Op::Power(plain(a), plain(b)),
                    _ => Op::Constant(Constant::ZERO), // all others are above
                };
                positive(self.new.push(op))
            }
        }
    }

    fn sum(&mut self, id: OpId, a: Value, b: Value) -> Value {
        let turned = a.negative != b.negative && self.changes.turned.contains(&id);
        let sign = |value: Value| Value {
            negative: value.negative != turned,
            op: value.op,
        };
        if a.op == b.op && a.negative != b.negative {
            return self.zero();
        }
        if !turned {
            return self.new.add(a, b);
        }
        let total = self.new.add(sign(a), sign(b));
        Value {
            negative: !total.negative,
            op: total.op,
        }
    }

    fn zero(&mut self) -> Value {
        Value {
            negative: false,
            op: self.new.push(Op::Constant(Constant::ZERO)),
        }
    }
}
