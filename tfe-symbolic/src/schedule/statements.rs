//! From arranged operations to a program: temporaries are defined as they are needed, each as far outside the loops as
//! possible.

use crate::expr::function::Function;
use crate::expr::graph::{SumRange, loop_bit};
use crate::expr::hash::{Map, Set};
use crate::expr::input::LoopVariable;
use crate::expr::ordered::SortedSet;
use crate::expr::sorting::sort_by_key;
use crate::optimise::canonical_order::ranks;
use crate::optimise::plan::{Op, OpId, Plan, Value};
use crate::program::{Array, Operand, Operation, Program, Statement, Temporary};
use crate::schedule::balance::Balance;
use crate::schedule::loop_nest::{Block, Local, Sink, Target};

/// Schedules a plan that holds the values of all results; these arrays are cleared first.
pub(crate) fn schedule(
    plan: Plan,
    cleared: &SortedSet<Array>,
    root: &Block,
    balances: &[Balance],
) -> Program {
    let mut scheduler = Scheduler {
        reductions: plan
            .ids()
            .filter(|id| matches!(plan.op(*id), Op::Loop { .. }))
            .collect(),
        ranks: ranks(&plan),
        plan,
        scopes: vec![Scope::default()],
        temporaries: 0,
        locals: Map::default(),
    };
    for array in cleared {
        scheduler.append(Statement::Clear { array: *array });
    }
    scheduler.angles();
    scheduler.block(root);
    for Balance { first, length } in balances {
        scheduler.append(Statement::Balance {
            output: first.clone(),
            length: length.clone(),
        });
    }
    let statements = scheduler.scopes.swap_remove(0).statements;
    Program {
        statements,
        temporaries: scheduler.temporaries,
    }
}

/// The body being written of one loop (or of the program), with the values known in it.
#[derive(Default)]
struct Scope {
    /// The bit of its variable; none for the program itself.
    bit: u64,
    statements: Vec<Statement>,
    values: Map<OpId, Operand>,
    /// The operations with sums over ranges in them that a turn needs.
    sums: Set<OpId>,
}

struct Scheduler {
    plan: Plan,
    /// Which operand of sums and products stands first.
    ranks: Vec<usize>,
    /// The sums over ranges that are values.
    reductions: Vec<OpId>,
    scopes: Vec<Scope>,
    temporaries: u32,
    /// The variables that loops change.
    locals: Map<usize, Temporary>,
}

impl Scheduler {
    fn temporary(&mut self) -> Temporary {
        self.temporaries += 1;
        Temporary(self.temporaries - 1)
    }

    fn append(&mut self, statement: Statement) {
        if let Some(scope) = self.scopes.last_mut() {
            scope.statements.push(statement);
        }
    }

    /// Sines and cosines come first: every value that is live across a call has to be kept in memory.
    fn angles(&mut self) {
        let angle = |id: &OpId| {
            let call = matches!(
                self.plan.op(*id),
                Op::Call(Function::Sin | Function::Cos, _)
            );
            call && self.plan.loops_of(*id) == 0 && !self.plan.reduces(*id)
        };
        let mut angles: Vec<OpId> = self.plan.ids().filter(angle).collect();
        // In the order of the coordinates; what has to be computed comes after them.
        sort_by_key(&mut angles, |id| match self.plan.op(*id).operands()[..] {
            [argument] => match self.plan.op(argument) {
                Op::Input(input) => (false, Some(input.clone())),
                _ => (true, None),
            },
            _ => (true, None),
        });
        for id in angles {
            self.operand(id);
        }
    }

    fn block(&mut self, block: &Block) {
        for (local, start) in &block.locals {
            let start = match start.and_then(|start| self.plan.value(start)) {
                Some(start) => self.plain(start),
                None => Operand::Constant(0.0),
            };
            let target = self.temporary();
            self.locals.insert(local.0, target);
            self.append(Statement::Accumulator { target, start });
        }
        for sink in &block.sinks {
            self.sink(sink);
        }
        for (range, inner) in &block.inner {
            let sums = self.sums_in(self.values_of(inner));
            self.open(range.variable, sums);
            self.block(inner);
            self.close(range);
        }
        for sink in &block.after {
            self.sink(sink);
        }
    }

    fn sink(&mut self, sink: &Sink) {
        let value = sink.value.and_then(|value| self.plan.value(value));
        let local = sink.local.and_then(|local| self.local(local));
        let value = match (local, value) {
            (Some(local), Some(value)) => self.onto(local, value),
            (Some(local), None) => Operand::Temporary(local),
            (None, Some(value)) => match &sink.target {
                Target::Add(local) if value.negative => return self.take_away(*local, value),
                _ => self.plain(value),
            },
            (None, None) => return,
        };
        match &sink.target {
            Target::Store { place, accumulate } => self.append(Statement::Store {
                output: place.clone(),
                value,
                accumulate: *accumulate,
            }),
            Target::Add(local) => {
                if let Some(target) = self.local(*local) {
                    self.append(Statement::Accumulate { target, value });
                }
            }
            Target::Set(local) => {
                if let Some(target) = self.local(*local) {
                    self.append(Statement::Assign { target, value });
                }
            }
        }
    }

    /// Subtracts a value from a running sum if it would otherwise have to be negated and added.
    fn take_away(&mut self, local: Local, value: Value) {
        if let Some(target) = self.local(local) {
            let value = self.onto(target, value);
            self.append(Statement::Assign { target, value });
        }
    }

    fn local(&self, local: Local) -> Option<Temporary> {
        self.locals.get(&local.0).copied()
    }

    /// A variable plus a value. The sum is not an operation of the plan, because the variable has another value on the
    /// next turn.
    fn onto(&mut self, local: Temporary, value: Value) -> Operand {
        let (local, other) = (Operand::Temporary(local), self.operand(value.op));
        let operation = if value.negative {
            Operation::Subtract(local, other)
        } else {
            Operation::Add(local, other)
        };
        let target = self.temporary();
        self.append(Statement::Let { target, operation });
        Operand::Temporary(target)
    }

    fn open(&mut self, variable: LoopVariable, sums: Set<OpId>) {
        self.scopes.push(Scope {
            bit: loop_bit(variable),
            sums,
            ..Scope::default()
        });
    }

    /// What is computed in a block and in the loops inside. Recursion is as deep as the loops nest.
    fn values_of(&self, block: &Block) -> Vec<OpId> {
        let starts = block.locals.iter().filter_map(|(_, start)| *start);
        let sinks = block.sinks.iter().chain(&block.after);
        let values = starts.chain(sinks.filter_map(|sink| sink.value));
        let mut found: Vec<OpId> = values
            .filter_map(|value| self.plan.value(value))
            .map(|value| value.op)
            .collect();
        for (_, inner) in &block.inner {
            found.extend(self.values_of(inner));
        }
        found
    }

    /// Of these operations and all that they need, those with sums over ranges in them.
    fn sums_in(&self, operations: Vec<OpId>) -> Set<OpId> {
        let (mut sums, mut waiting) = (Set::default(), operations);
        while let Some(id) = waiting.pop() {
            if self.plan.reduces(id) && sums.insert(id) {
                waiting.extend(self.plan.op(id).operands());
            }
        }
        sums
    }

    fn close(&mut self, range: &SumRange) {
        if let Some(scope) = self.scopes.pop() {
            self.append(Statement::Loop {
                variable: range.variable,
                start: range.start.clone(),
                end: range.end.clone(),
                body: scope.statements,
            });
        }
    }

    /// The outermost scope in which an operation can be computed.
    fn level(&self, id: OpId) -> usize {
        let loops = self.plan.loops_of(id);
        self.scopes
            .iter()
            .rposition(|scope| scope.bit & loops != 0)
            .unwrap_or(0)
    }

    fn known(&self, id: OpId) -> Option<Operand> {
        match self.plan.op(id) {
            Op::Constant(value) => Some(Operand::Constant(value.to_f64())),
            Op::Input(input) => Some(Operand::Input(input.clone())),
            _ => self.scopes[self.level(id)].values.get(&id).cloned(),
        }
    }

    /// A value without its sign beside it.
    fn plain(&mut self, value: Value) -> Operand {
        let id = self.plan.plain(value);
        self.operand(id)
    }

    /// Computes an operation and all it needs, where that has not been done.
    fn operand(&mut self, id: OpId) -> Operand {
        let mut stack = vec![id];
        while let Some(&top) = stack.last() {
            if self.known(top).is_some() {
                stack.pop();
                continue;
            }
            let op = self.operation(top);
            if let Op::Loop { range, .. } = &op {
                self.reduce(top, range);
                stack.pop();
                continue;
            }
            let before = stack.len();
            stack.extend(
                op.operands()
                    .into_iter()
                    .rev()
                    .filter(|operand| self.known(*operand).is_none()),
            );
            if stack.len() == before {
                self.compute(top, &op);
                stack.pop();
            }
        }
        // Known by construction; a gap in the plan would show as NaN in tests, not as a panic in a compiler.
        self.known(id).unwrap_or(Operand::Constant(f64::NAN))
    }

    /// The operation, with the operands of sums and products in the order that like ones have in common.
    fn operation(&self, id: OpId) -> Op {
        let key = |id: OpId| {
            let input = match self.plan.op(id) {
                Op::Input(input) => Some(input),
                _ => None,
            };
            (self.ranks.get(id.index()), input)
        };
        match self.plan.op(id) {
            Op::Add(a, b) if key(*b) < key(*a) => Op::Add(*b, *a),
            Op::Multiply(a, b) if key(*b) < key(*a) => Op::Multiply(*b, *a),
            op => op.clone(),
        }
    }

    /// Writes the operation, whose operands are known.
    fn compute(&mut self, id: OpId, op: &Op) {
        let known = |id: &OpId| self.known(*id).unwrap_or(Operand::Constant(f64::NAN));
        let operation = match op {
            Op::Constant(_) | Op::Input(_) | Op::Loop { .. } => return,
            Op::Add(a, b) => Operation::Add(known(a), known(b)),
            Op::Subtract(a, b) => Operation::Subtract(known(a), known(b)),
            Op::Multiply(a, b) => Operation::Multiply(known(a), known(b)),
            Op::Divide(a, b) => Operation::Divide(known(a), known(b)),
            Op::Negate(a) => Operation::Negate(known(a)),
            Op::IntegerPower(a, n) => Operation::IntegerPower(known(a), *n),
            Op::Power(a, b) => Operation::Power(known(a), known(b)),
            Op::Call(function @ (Function::Sin | Function::Cos), arguments) => {
                let sine = self.plan.find(&Op::Call(Function::Sin, arguments.clone()));
                let cosine = self.plan.find(&Op::Call(Function::Cos, arguments.clone()));
                if let (Some(sine), Some(cosine), [argument]) = (sine, cosine, &arguments[..]) {
                    let argument = known(argument);
                    return self.sine_and_cosine(sine, cosine, argument);
                }
                Operation::Call(*function, arguments.iter().map(known).collect())
            }
            Op::Call(function, arguments) => {
                Operation::Call(*function, arguments.iter().map(known).collect())
            }
            Op::Select {
                comparison,
                left,
                right,
                then,
                otherwise,
            } => Operation::Select {
                comparison: *comparison,
                left: known(left),
                right: known(right),
                then: known(then),
                otherwise: known(otherwise),
            },
        };
        let target = self.temporary();
        let level = self.level(id);
        let scope = &mut self.scopes[level];
        scope.statements.push(Statement::Let { target, operation });
        scope.values.insert(id, Operand::Temporary(target));
    }

    fn sine_and_cosine(&mut self, sine: OpId, cosine: OpId, argument: Operand) {
        let level = self.level(sine);
        let (s, c) = (self.temporary(), self.temporary());
        let scope = &mut self.scopes[level];
        scope.statements.push(Statement::SineCosine {
            sine: s,
            cosine: c,
            argument,
        });
        scope.values.insert(sine, Operand::Temporary(s));
        scope.values.insert(cosine, Operand::Temporary(c));
    }

    /// Computes a sum over a range, and with it in one loop all others over the same range that need no sum themselves.
    ///
    /// Others that depend on the loops around are taken along where these need them: another loop over the same index may go further, beyond
    /// the arrays that they read.
    fn reduce(&mut self, id: OpId, range: &SumRange) {
        let level = self.level(id);
        let inside = self.scopes.split_off(level + 1);
        let is_the_same_everywhere = self.plan.loops_of(id) == 0;
        let together: Vec<(OpId, OpId)> = self
            .reductions
            .iter()
            .filter_map(|other| match self.plan.op(*other) {
                Op::Loop { range: own, body } => Some((*other, own, *body)),
                _ => None,
            })
            .filter(|(other, own, body)| {
                *other == id
                    || (*own == range
                        && self.plan.loops_of(*other) == self.plan.loops_of(id)
                        && !self.plan.reduces(*body)
                        && (is_the_same_everywhere || self.scopes[level].sums.contains(other))
                        && self.known(*other).is_none())
            })
            .map(|(other, _, body)| (other, body))
            .collect();
        let mut totals = Vec::with_capacity(together.len());
        for (other, body) in together {
            let target = self.temporary();
            self.append(Statement::Accumulator {
                target,
                start: Operand::Constant(0.0),
            });
            totals.push((other, body, target));
        }
        let sums = self.sums_in(totals.iter().map(|(_, body, _)| *body).collect());
        self.open(range.variable, sums);
        for (_, body, target) in &totals {
            let value = self.operand(*body);
            self.append(Statement::Accumulate {
                target: *target,
                value,
            });
        }
        self.close(range);
        for (other, _, target) in totals {
            self.scopes[level]
                .values
                .insert(other, Operand::Temporary(target));
        }
        self.scopes.extend(inside);
    }
}
