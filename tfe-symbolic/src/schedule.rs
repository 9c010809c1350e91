//! From arranged operations to a program: temporaries in the order of their use, each as far outside of the loops as it can be.

use std::collections::HashMap;

use crate::function::Function;
use crate::graph::{ExprId, SumRange, loop_bit};
use crate::input::LoopVariable;
use crate::plan::{Op, OpId, Plan, Value};
use crate::program::{Operand, Operation, Output, Program, Statement, Temporary};

/// What is computed at one level of nesting, and the loops inside.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    /// Results at this level.
    pub(crate) sinks: Vec<Sink>,
    /// The loops at this level.
    pub(crate) inner: Vec<(SumRange, Block)>,
}

/// A result.
#[derive(Clone, Debug)]
pub(crate) struct Sink {
    /// Where it goes; several entries of equal value are computed once.
    pub(crate) target: Target,
    /// What it is.
    pub(crate) value: ExprId,
}

/// Where a result goes.
#[derive(Clone, Debug)]
pub(crate) enum Target {
    /// Into the results.
    Store { output: Output, accumulate: bool },
    /// Onto the value that is stored at the end of the program.
    Value,
}

/// Schedules a plan that holds the values of all sinks.
pub(crate) fn schedule(plan: Plan, cleared: Vec<Output>, root: &Block) -> Program {
    let looped = has_value(&root.inner);
    let mut scheduler = Scheduler {
        reductions: plan
            .ids()
            .filter(|id| matches!(plan.op(*id), Op::Loop { .. }))
            .collect(),
        plan,
        scopes: vec![Scope::default()],
        temporaries: 0,
        value: None,
    };
    for output in cleared {
        scheduler.append(Statement::Clear { output });
    }
    if looped {
        let total = scheduler.temporary();
        scheduler.append(Statement::Accumulator { target: total });
        scheduler.value = Some(total);
    }
    scheduler.block(root);
    if let Some(total) = scheduler.value {
        let value = Operand::Temporary(total);
        scheduler.append(Statement::Store {
            output: Output::Value,
            value,
            accumulate: false,
        });
    }
    let statements = scheduler.scopes.swap_remove(0).statements;
    Program {
        statements,
        temporaries: scheduler.temporaries,
    }
}

/// Whether a loop adds to the energy.
fn has_value(inner: &[(SumRange, Block)]) -> bool {
    inner.iter().any(|(_, block)| {
        block
            .sinks
            .iter()
            .any(|sink| matches!(sink.target, Target::Value))
            || has_value(&block.inner)
    })
}

/// The body being written of one loop (or of the program), with the values known in it.
#[derive(Default)]
struct Scope {
    /// The bit of its variable; none for the program itself.
    bit: u64,
    statements: Vec<Statement>,
    values: HashMap<OpId, Operand>,
}

struct Scheduler {
    plan: Plan,
    /// The sums over ranges that are values.
    reductions: Vec<OpId>,
    scopes: Vec<Scope>,
    temporaries: u32,
    /// The running sum of the energy where loops add to it.
    value: Option<Temporary>,
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

    fn block(&mut self, block: &Block) {
        for sink in &block.sinks {
            let Some(value) = self.plan.value(sink.value) else {
                continue;
            };
            let value = self.plain(value);
            match &sink.target {
                Target::Store { output, accumulate } => {
                    let (output, accumulate) = (output.clone(), *accumulate);
                    self.append(Statement::Store {
                        output,
                        value,
                        accumulate,
                    });
                }
                Target::Value => match self.value {
                    Some(target) => self.append(Statement::Accumulate { target, value }),
                    None => self.append(Statement::Store {
                        output: Output::Value,
                        value,
                        accumulate: false,
                    }),
                },
            }
        }
        for (range, inner) in &block.inner {
            self.open(range.variable);
            self.block(inner);
            self.close(range);
        }
    }

    fn open(&mut self, variable: LoopVariable) {
        self.scopes.push(Scope {
            bit: loop_bit(variable),
            ..Scope::default()
        });
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
            let op = self.plan.op(top).clone();
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
        // Known by construction; a hole in the plan shows as NaN in tests, not as a panic in a compiler.
        self.known(id).unwrap_or(Operand::Constant(f64::NAN))
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
    fn reduce(&mut self, id: OpId, range: &SumRange) {
        let level = self.level(id);
        let inside = self.scopes.split_off(level + 1);
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
                        && self.known(*other).is_none())
            })
            .map(|(other, _, body)| (other, body))
            .collect();
        let mut totals = Vec::with_capacity(together.len());
        for (other, body) in together {
            let target = self.temporary();
            self.append(Statement::Accumulator { target });
            totals.push((other, body, target));
        }
        self.open(range.variable);
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
