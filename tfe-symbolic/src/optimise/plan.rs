//! Plans: hash-consed operations with two operands, which only remain to be put in order.

use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, SumRange, loop_bit, loops_in};
use crate::expr::hash::Map;
use crate::expr::input::{Affine, Input};
use crate::expr::ordered::SortedMap;
use crate::program::cost;

/// An operation of a [`Plan`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct OpId(u32);

impl OpId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// An operation of at most two operands (but for a choice).
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Op {
    Constant(Constant),
    Input(Input),
    Add(OpId, OpId),
    Subtract(OpId, OpId),
    Multiply(OpId, OpId),
    Divide(OpId, OpId),
    Negate(OpId),
    IntegerPower(OpId, i32),
    Power(OpId, OpId),
    Call(Function, Vec<OpId>),
    Select {
        comparison: Comparison,
        left: OpId,
        right: OpId,
        then: OpId,
        otherwise: OpId,
    },
    Loop {
        range: SumRange,
        body: OpId,
    },
}

/// An operation, or its negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Value {
    pub(crate) negative: bool,
    pub(crate) op: OpId,
}

/// Operations, operands before users, each different from all others.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan {
    ops: Vec<Op>,
    loops: Vec<u64>,
    /// Whether there is a sum over a range in it.
    reduces: Vec<bool>,
    known: Map<Op, OpId>,
    values: SortedMap<ExprId, Value>,
}

impl Plan {
    /// The operation itself.
    pub(crate) fn op(&self, id: OpId) -> &Op {
        &self.ops[id.index()]
    }

    /// Its free loop variables, one bit a depth.
    pub(crate) fn loops_of(&self, id: OpId) -> u64 {
        self.loops[id.index()]
    }

    /// Whether there is a sum over a range in it.
    pub(crate) fn reduces(&self, id: OpId) -> bool {
        self.reduces[id.index()]
    }

    /// All of them.
    pub(crate) fn ids(&self) -> impl Iterator<Item = OpId> + use<> {
        (0..self.ops.len() as u32).map(OpId)
    }

    /// The operation if it is there.
    pub(crate) fn find(&self, op: &Op) -> Option<OpId> {
        self.known.get(op).copied()
    }

    /// The cost in the measure of [`crate::program::count::Counts::weighted`].
    pub(crate) fn cost(&self) -> usize {
        self.ids().map(|id| self.cost_of(id)).sum()
    }

    /// What one operation adds to the cost.
    pub(crate) fn cost_of(&self, id: OpId) -> usize {
        let has = |function, arguments: &Vec<OpId>| {
            self.find(&Op::Call(function, arguments.clone())).is_some()
        };
        match self.op(id) {
            Op::Constant(_) | Op::Input(_) | Op::Negate(_) => 0,
            Op::Add(..) | Op::Subtract(..) | Op::Loop { .. } => cost::ADDITION,
            Op::Multiply(..) => cost::PRODUCT,
            Op::Select { .. } => cost::CHOICE,
            Op::Divide(..) => cost::QUOTIENT,
            // One of both counts for the pair.
            Op::Call(Function::Sin, arguments) if has(Function::Cos, arguments) => {
                cost::SINE_WITH_COSINE
            }
            Op::Call(Function::Cos, arguments) if has(Function::Sin, arguments) => 0,
            Op::Call(Function::Sin | Function::Cos, _) => cost::LONE_SINE,
            Op::IntegerPower(..) | Op::Power(..) | Op::Call(..) => cost::FUNCTION,
        }
    }

    /// How many operations have no operand that they may overwrite, because each is an input or still needed afterwards.
    pub(crate) fn copies(&self) -> usize {
        let mut last = vec![usize::MAX; self.ops.len()];
        for id in self.ids() {
            for operand in self.op(id).operands() {
                if !matches!(self.op(operand), Op::Constant(_) | Op::Input(_)) {
                    last[operand.index()] = id.index();
                }
            }
        }
        let copies = |id: &OpId| {
            let ends = |operand: &OpId| last[operand.index()] == id.index();
            match self.op(*id) {
                Op::Add(a, b) | Op::Multiply(a, b) => !ends(a) && !ends(b),
                Op::Subtract(a, _) | Op::Divide(a, _) | Op::Negate(a) => !ends(a),
                _ => false,
            }
        };
        self.ids().filter(copies).count()
    }

    /// The number of operations.
    pub(crate) fn len(&self) -> usize {
        self.ops.len()
    }

    /// What a root has become; the roots are those given to [`crate::optimise::binarize::arrange`].
    pub(crate) fn value(&self, root: ExprId) -> Option<Value> {
        self.values.get(&root).copied()
    }

    /// Notes what a root has become.
    pub(crate) fn set_value(&mut self, root: ExprId, value: Value) {
        self.values.insert(root, value);
    }

    /// Forgets other roots.
    pub(crate) fn retain_values(&mut self, wanted: impl Fn(ExprId) -> bool) {
        self.values.retain(|root, _| wanted(*root));
    }

    /// All roots and what they have become, in no order.
    pub(crate) fn values(&self) -> impl Iterator<Item = (ExprId, Value)> + '_ {
        self.values.iter().map(|(root, value)| (*root, *value))
    }

    /// Finds or makes an operation.
    pub(crate) fn push(&mut self, op: Op) -> OpId {
        if let Some(id) = self.known.get(&op) {
            return *id;
        }
        let mut loops = op
            .operands()
            .iter()
            .fold(0, |mask, operand| mask | self.loops_of(*operand));
        let mut add = |index: &Affine| loops |= loops_in(index);
        match &op {
            Op::Input(input) => {
                if let Some(index) = input.index() {
                    add(index);
                }
            }
            Op::Loop { range, body } => {
                let inner = self.loops_of(*body) & !loop_bit(range.variable);
                add(&range.start);
                add(&range.end);
                loops = (loops & !loop_bit(range.variable)) | inner;
            }
            _ => {}
        }
        let inside = op.operands().iter().any(|operand| self.reduces(*operand));
        self.reduces.push(inside || matches!(op, Op::Loop { .. }));
        let id = OpId(self.ops.len() as u32);
        self.ops.push(op.clone());
        self.loops.push(loops);
        self.known.insert(op, id);
        id
    }

    /// The value without a sign beside it.
    pub(crate) fn plain(&mut self, value: Value) -> OpId {
        if !value.negative {
            return value.op;
        }
        match self.op(value.op) {
            Op::Constant(number) => {
                let number = -*number;
                self.push(Op::Constant(number))
            }
            _ => self.push(Op::Negate(value.op)),
        }
    }

    /// a + b
    pub(crate) fn add(&mut self, a: Value, b: Value) -> Value {
        match (a.negative, b.negative) {
            (false, true) => Value {
                negative: false,
                op: self.push(Op::Subtract(a.op, b.op)),
            },
            (true, false) => Value {
                negative: false,
                op: self.push(Op::Subtract(b.op, a.op)),
            },
            (negative, _) => {
                let (first, second) = (a.op.min(b.op), a.op.max(b.op));
                Value {
                    negative,
                    op: self.push(Op::Add(first, second)),
                }
            }
        }
    }

    /// a b
    pub(crate) fn multiply(&mut self, a: Value, b: Value) -> Value {
        let (mut first, mut second) = (a.op.min(b.op), a.op.max(b.op));
        if matches!(self.op(second), Op::Constant(_)) {
            std::mem::swap(&mut first, &mut second); // numbers first, as people write
        }
        Value {
            negative: a.negative != b.negative,
            op: self.push(Op::Multiply(first, second)),
        }
    }
}

impl Op {
    /// The operands, in order.
    pub(crate) fn operands(&self) -> Vec<OpId> {
        match self {
            Self::Constant(_) | Self::Input(_) => Vec::new(),
            Self::Negate(a) | Self::IntegerPower(a, _) => vec![*a],
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Power(a, b) => {
                vec![*a, *b]
            }
            Self::Call(_, arguments) => arguments.clone(),
            Self::Select {
                left,
                right,
                then,
                otherwise,
                ..
            } => vec![*left, *right, *then, *otherwise],
            Self::Loop { body, .. } => vec![*body],
        }
    }
}
