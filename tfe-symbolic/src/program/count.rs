//! Operation counts of a program.

use std::fmt;
use std::ops::Add;

use crate::expr::function::Function;
use crate::program::cost;
use crate::program::{Operation, Program, Statement};

/// Operations by kind. Operations in a loop count once; stores and negations are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Counts {
    /// Additions and subtractions, with those onto results and running sums in loops
    pub additions: usize,
    /// Products
    pub multiplications: usize,
    /// Quotients
    pub divisions: usize,
    /// sin and cos of one argument together
    pub sine_cosine_pairs: usize,
    /// sin or cos alone
    pub lone_sines: usize,
    /// Other functions and powers
    pub functions: usize,
    /// Choices
    pub selections: usize,
    /// Changes of sign
    pub negations: usize,
}

impl Counts {
    /// The operations of a program.
    pub fn of(program: &Program) -> Self {
        let mut counts = Self::default();
        let mut stack: Vec<&Statement> = program.statements.iter().collect();
        while let Some(statement) = stack.pop() {
            match statement {
                Statement::Let { operation, .. } => counts.note(operation),
                Statement::SineCosine { .. } => counts.sine_cosine_pairs += 1,
                Statement::Accumulate { .. }
                | Statement::Balance { .. }
                | Statement::Store {
                    accumulate: true, ..
                } => counts.additions += 1,
                Statement::Loop { body, .. } => stack.extend(body),
                Statement::Accumulator { .. }
                | Statement::Assign { .. }
                | Statement::Store { .. }
                | Statement::Clear { .. } => {}
            }
        }
        counts
    }

    fn note(&mut self, operation: &Operation) {
        let counter = match operation {
            Operation::Add(..) | Operation::Subtract(..) => &mut self.additions,
            Operation::Multiply(..) => &mut self.multiplications,
            Operation::Divide(..) => &mut self.divisions,
            Operation::Negate(_) => &mut self.negations,
            Operation::Call(Function::Sin | Function::Cos, _) => &mut self.lone_sines,
            Operation::IntegerPower(..) | Operation::Power(..) | Operation::Call(..) => {
                &mut self.functions
            }
            Operation::Select { .. } => &mut self.selections,
        };
        *counter += 1;
    }

    /// How many values of sin and cos are computed.
    pub fn sine_cosine_evaluations(&self) -> usize {
        2 * self.sine_cosine_pairs + self.lone_sines
    }

    /// The cost in additions: product 1, quotient 6, choice 1, sine with cosine 25, one of them alone 20, other functions 20.
    ///
    /// Rounded from timings of scalar code and of lanes, where a sine alone costs as much as a pair; a program with the smaller cost is preferred.
    pub fn weighted(&self) -> usize {
        cost::ADDITION * self.additions
            + cost::PRODUCT * self.multiplications
            + cost::CHOICE * self.selections
            + cost::QUOTIENT * self.divisions
            + cost::SINE_WITH_COSINE * self.sine_cosine_pairs
            + cost::LONE_SINE * self.lone_sines
            + cost::FUNCTION * self.functions
    }
}

impl Add for Counts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            additions: self.additions + other.additions,
            multiplications: self.multiplications + other.multiplications,
            divisions: self.divisions + other.divisions,
            sine_cosine_pairs: self.sine_cosine_pairs + other.sine_cosine_pairs,
            lone_sines: self.lone_sines + other.lone_sines,
            functions: self.functions + other.functions,
            selections: self.selections + other.selections,
            negations: self.negations + other.negations,
        }
    }
}

/// `10 additions, 14 multiplications, 6 sines and cosines`, without what does not occur.
impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kinds = [
            (self.additions, "addition", "additions"),
            (self.multiplications, "multiplication", "multiplications"),
            (self.divisions, "division", "divisions"),
            (
                self.sine_cosine_evaluations(),
                "sine or cosine",
                "sines and cosines",
            ),
            (self.functions, "other function", "other functions"),
            (self.selections, "choice", "choices"),
        ];
        let mut first = true;
        for (count, one, many) in kinds.into_iter().filter(|(count, ..)| *count > 0) {
            let separator = if first { "" } else { ", " };
            write!(
                f,
                "{separator}{count} {}",
                if count == 1 { one } else { many }
            )?;
            first = false;
        }
        if first {
            f.write_str("no operations")
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::input::{Affine, Input};
    use crate::program::{Array, Operand, Place, Temporary};

    #[test]
    fn statements_count_by_kind_and_in_loops_once() {
        let q = || Operand::Input(Input::Time);
        let body = vec![
            Statement::Let {
                target: Temporary(0),
                operation: Operation::Multiply(q(), q()),
            },
            Statement::Store {
                output: Place::vector(Array::ByQ, Affine::default()),
                value: q(),
                accumulate: true,
            },
        ];
        let range = crate::expr::input::LoopVariable(0);
        let (start, end) = (Affine::constant(0), Affine::constant(9));
        let statements = vec![
            Statement::SineCosine {
                sine: Temporary(1),
                cosine: Temporary(2),
                argument: q(),
            },
            Statement::Loop {
                variable: range,
                start,
                end,
                body,
            },
        ];
        let counts = Counts::of(&Program {
            statements,
            temporaries: 3,
        });
        assert_eq!(
            counts.to_string(),
            "1 addition, 1 multiplication, 2 sines and cosines"
        );
        assert_eq!(counts.weighted(), 27);
        assert_eq!(Counts::default().to_string(), "no operations");
    }
}
