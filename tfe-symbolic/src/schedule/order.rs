//! The order of statements: an operation is executed as soon as it is the last reader of some value.
//!
//! Its result can take the register of a value that nothing else needs. So fewer values are live at a time, and fewer
//! are copied before an operation overwrites them. Of all operations whose operands are known, the one that reads most
//! values for the last time comes first, and among equal ones the one that was first before; a result is stored at
//! once. Sines and cosines keep their places, with everything that precedes them.

use std::cmp::Reverse;

use crate::expr::function::Function;
use crate::expr::hash::{Map, Set};
use crate::expr::input::Input;
use crate::expr::ordered::SortedSet;
use crate::expr::sorting::sort;
use crate::program::{Operand, Operation, Statement, Temporary};

/// The same statements in an order that keeps few values live, as far as they are independent; temporaries are numbered
/// in the order of their definition.
pub(crate) fn in_order(statements: Vec<Statement>) -> Vec<Statement> {
    let mut statements = ordered(statements);
    let mut numbers = Numbers::default();
    numbers.number(&mut statements);
    statements
}

/// A value that may be in a register.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Value {
    Temporary(Temporary),
    Input(Input),
}

/// The statements of a program, or of the body of a loop.
fn ordered(statements: Vec<Statement>) -> Vec<Statement> {
    let mut scope = Scope::of(&statements);
    let (mut done, mut run) = (Vec::with_capacity(statements.len()), Vec::new());
    for statement in statements {
        match statement {
            Statement::Let { .. }
            | Statement::SineCosine { .. }
            | Statement::Store {
                accumulate: false, ..
            } => run.push(statement),
            other => {
                scope.arrange(std::mem::take(&mut run), &mut done);
                scope.read(&other);
                done.push(match other {
                    Statement::Loop {
                        variable,
                        start,
                        end,
                        body,
                    } => Statement::Loop {
                        variable,
                        start,
                        end,
                        body: ordered(body),
                    },
                    other => other,
                });
            }
        }
    }
    scope.arrange(run, &mut done);
    done
}

/// The number of statements that have still to read each value.
struct Scope {
    left: Map<Value, usize>,
}

impl Scope {
    fn of(statements: &[Statement]) -> Self {
        let (mut left, mut own) = (Map::default(), Set::default());
        for statement in statements {
            for value in reads(statement) {
                *left.entry(value).or_default() += 1;
            }
            own.extend(defines(statement));
        }
        // A value from outside the loop is read again on the next turn.
        left.retain(
            |value| !matches!(value, Value::Temporary(temporary) if !own.contains(temporary)),
        );
        Self { left }
    }

    fn read(&mut self, statement: &Statement) {
        for value in reads(statement) {
            if let Some(left) = self.left.get_mut(&value) {
                *left -= 1;
            }
        }
    }

    /// The number of values that are read for the last time; larger than any such number for a result, which is stored
    /// at once.
    fn ends(&self, statement: &Statement, reads: &[Value]) -> usize {
        match statement {
            Statement::Store { .. } => usize::MAX,
            _ => {
                let ends = |value: &&Value| self.left.get(value) == Some(&1);
                reads.iter().filter(ends).count()
            }
        }
    }

    /// Appends a run of statements of which each may come as soon as its operands are known.
    fn arrange(&mut self, mut run: Vec<Statement>, done: &mut Vec<Statement>) {
        let angles = run.iter().rposition(is_angle).map_or(0, |last| last + 1);
        for statement in run.drain(..angles) {
            self.read(&statement);
            done.push(statement);
        }
        let all_reads: Vec<Vec<Value>> = run.iter().map(reads).collect();
        let mut readers: Map<&Value, Vec<usize>> = Map::default();
        for (at, reads) in all_reads.iter().enumerate() {
            for value in reads {
                readers.entry(value).or_default().push(at);
            }
        }
        let users = |temporary: Temporary| {
            let users = readers.get(&Value::Temporary(temporary));
            users.map_or(&[][..], Vec::as_slice)
        };
        // Operands that are still to be computed.
        let mut missing = vec![0_usize; run.len()];
        for statement in &run {
            for temporary in defines(statement) {
                for user in users(temporary) {
                    missing[*user] += 1;
                }
            }
        }
        let mut ends: Vec<usize> = run
            .iter()
            .zip(&all_reads)
            .map(|(statement, reads)| self.ends(statement, reads))
            .collect();
        let known = (0..run.len()).filter(|at| missing[*at] == 0);
        let mut ready: SortedSet<(usize, Reverse<usize>)> =
            known.map(|at| (ends[at], Reverse(at))).collect();
        let mut waiting = vec![true; run.len()];
        let mut order = Vec::with_capacity(run.len());
        while let Some((_, Reverse(at))) = ready.pop_last() {
            order.push(at);
            waiting[at] = false;
            self.read(&run[at]);
            for value in &all_reads[at] {
                if self.left.get(value) != Some(&1) {
                    continue;
                }
                // The one reader that is left may stand after the run.
                let others = readers.get(value).into_iter().flatten();
                for other in others.filter(|other| waiting[**other]) {
                    let now = self.ends(&run[*other], &all_reads[*other]);
                    let before = std::mem::replace(&mut ends[*other], now);
                    if ready.remove(&(before, Reverse(*other))) {
                        ready.insert((now, Reverse(*other)));
                    }
                }
            }
            for user in defines(&run[at]).into_iter().flat_map(users) {
                missing[*user] -= 1;
                if missing[*user] == 0 {
                    ready.insert((ends[*user], Reverse(*user)));
                }
            }
        }
        let mut run: Vec<Option<Statement>> = run.into_iter().map(Some).collect();
        done.extend(order.into_iter().filter_map(|at| run[at].take()));
    }
}

fn is_angle(statement: &Statement) -> bool {
    match statement {
        Statement::SineCosine { .. } => true,
        Statement::Let { operation, .. } => {
            matches!(operation, Operation::Call(Function::Sin | Function::Cos, _))
        }
        _ => false,
    }
}

/// The temporaries that begin here.
fn defines(statement: &Statement) -> Vec<Temporary> {
    match statement {
        Statement::Let { target, .. } | Statement::Accumulator { target, .. } => vec![*target],
        Statement::SineCosine { sine, cosine, .. } => vec![*sine, *cosine],
        _ => Vec::new(),
    }
}

/// What a statement reads, each once; of a loop, all that its body reads.
fn reads(statement: &Statement) -> Vec<Value> {
    let mut values: Vec<Value> = match statement {
        Statement::Loop { body, .. } => body.iter().flat_map(reads).collect(),
        other => {
            let operands = other.operands().into_iter();
            operands
                .filter_map(|operand| match operand {
                    Operand::Temporary(temporary) => Some(Value::Temporary(*temporary)),
                    Operand::Input(input) => Some(Value::Input(input.clone())),
                    Operand::Constant(_) => None,
                })
                .collect()
        }
    };
    sort(&mut values);
    values.dedup();
    values
}

/// New numbers of temporaries.
#[derive(Default)]
struct Numbers {
    known: Map<Temporary, Temporary>,
}

impl Numbers {
    fn of(&mut self, temporary: Temporary) -> Temporary {
        let next = Temporary(self.known.len() as u32);
        *self.known.entry(temporary).or_insert(next)
    }

    fn number(&mut self, statements: &mut [Statement]) {
        for statement in statements {
            statement.for_each_temporary(&mut |temporary| *temporary = self.of(*temporary));
            if let Statement::Loop { body, .. } = statement {
                self.number(body);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::input::Affine;
    use crate::program::{Array, Place, Program};

    fn coordinate(k: i64) -> Operand {
        Operand::Input(Input::Coordinate(Affine::constant(k)))
    }

    fn temporary(k: u32) -> Operand {
        Operand::Temporary(Temporary(k))
    }

    fn product(target: u32, a: Operand, b: Operand) -> Statement {
        Statement::Let {
            target: Temporary(target),
            operation: Operation::Multiply(a, b),
        }
    }

    fn store(k: i64, value: u32) -> Statement {
        Statement::Store {
            output: Place::vector(Array::ByQ, Affine::constant(k)),
            value: temporary(value),
            accumulate: false,
        }
    }

    #[track_caller]
    fn check(statements: Vec<Statement>, expected: &str) {
        let program = Program {
            temporaries: 0,
            statements: in_order(statements),
        };
        assert_eq!(program.to_string().trim(), expected);
    }

    #[test]
    fn what_reads_something_last_comes_first() {
        // The second product is the last to read q[1], and its result is stored at once.
        let statements = vec![
            product(0, coordinate(0), coordinate(0)),
            product(1, coordinate(1), coordinate(0)),
            product(2, temporary(0), coordinate(0)),
            store(0, 2),
            store(1, 1),
        ];
        check(
            statements,
            "t0 = q[1] * q[0]\nE_q[1] = t0\nt1 = q[0] * q[0]\nt2 = t1 * q[0]\nE_q[0] = t2",
        );
    }

    #[test]
    fn sines_stay_before_all_else() {
        let statements = vec![
            Statement::SineCosine {
                sine: Temporary(0),
                cosine: Temporary(1),
                argument: coordinate(0),
            },
            Statement::SineCosine {
                sine: Temporary(2),
                cosine: Temporary(3),
                argument: coordinate(1),
            },
            product(4, temporary(2), temporary(3)),
            product(5, temporary(0), temporary(1)),
            product(6, temporary(4), temporary(5)),
            store(0, 6),
        ];
        check(
            statements,
            "(t0, t1) = sin_cos(q[0])\n(t2, t3) = sin_cos(q[1])\nt4 = t2 * t3\nt5 = t0 * t1\nt6 = t4 * t5\nE_q[0] = t6",
        );
    }

    #[test]
    fn values_from_outside_of_a_loop_never_end_in_it() {
        let variable = crate::expr::input::LoopVariable(0);
        let inside = vec![
            product(1, coordinate(0), coordinate(0)),
            product(2, temporary(0), temporary(0)),
            product(3, temporary(1), temporary(2)),
            store(0, 3),
        ];
        let statements = vec![
            product(0, coordinate(1), coordinate(1)),
            Statement::Loop {
                variable,
                start: Affine::constant(0),
                end: Affine::constant(2),
                body: inside.clone(),
            },
        ];
        assert_eq!(in_order(statements.clone()), statements);
    }

    #[test]
    fn what_is_added_to_a_place_stays_in_order() {
        let add = |k| Statement::Store {
            output: Place::vector(Array::ByQ, Affine::constant(k)),
            value: coordinate(k),
            accumulate: true,
        };
        let statements = vec![
            product(0, coordinate(0), coordinate(1)),
            store(0, 0),
            add(0),
            product(1, coordinate(1), coordinate(1)),
            store(1, 1),
        ];
        assert_eq!(in_order(statements.clone()), statements);
    }
}
