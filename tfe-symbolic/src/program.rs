//! Straight-line programs with loops: what is emitted as Rust, and what the interpreter runs.
//!
//! This is the contract between the engine, which schedules programs, and the emitter. The files of the folder count,
//! run and print programs. May import `expr` only.

pub(crate) mod cost;
pub mod count;
mod display;
pub mod interpret;
pub mod place;
pub mod request;

use crate::expr::comparison::Comparison;
use crate::expr::function::Function;
use crate::expr::input::{Affine, Input, LoopVariable};

pub use place::{Array, Place};
pub use request::{By, Request};

/// A value computed by a program. Each is assigned once (accumulators: declared once, then added to or assigned).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Temporary(pub u32);

/// An argument of an operation.
#[derive(Clone, Debug, PartialEq)]
pub enum Operand {
    /// A value computed before.
    Temporary(Temporary),
    /// A number.
    Constant(f64),
    /// An input of the kernel.
    Input(Input),
}

/// One operation.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation {
    /// `a + b`
    Add(Operand, Operand),
    /// `a − b`
    Subtract(Operand, Operand),
    /// `a b`
    Multiply(Operand, Operand),
    /// `a / b`
    Divide(Operand, Operand),
    /// `−a`
    Negate(Operand),
    /// `a` to an integer power that is not written as products
    IntegerPower(Operand, i32),
    /// `a^b`
    Power(Operand, Operand),
    /// An elementary function of one or two arguments
    Call(Function, Vec<Operand>),
    /// `if left comparison right { then } else { otherwise }`, both sides evaluated
    Select {
        /// The comparison
        comparison: Comparison,
        /// Left of it
        left: Operand,
        /// Right of it
        right: Operand,
        /// The value where it holds
        then: Operand,
        /// The value elsewhere
        otherwise: Operand,
    },
}

/// One step of a program.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    /// `let target = operation`
    Let {
        /// The value assigned
        target: Temporary,
        /// How it is computed
        operation: Operation,
    },
    /// `let (sine, cosine) = argument.sin_cos()`
    SineCosine {
        /// sin of the argument
        sine: Temporary,
        /// cos of the argument
        cosine: Temporary,
        /// The argument
        argument: Operand,
    },
    /// `let mut target = start`, before a loop that changes it
    Accumulator {
        /// The running sum
        target: Temporary,
        /// What it begins with
        start: Operand,
    },
    /// `target += value`, inside the loop
    Accumulate {
        /// The running sum
        target: Temporary,
        /// What is added
        value: Operand,
    },
    /// `target = value`, inside the loop: the value with which the next turn begins
    Assign {
        /// The running sum
        target: Temporary,
        /// What it becomes
        value: Operand,
    },
    /// `for variable in start..end { body }`
    Loop {
        /// The index
        variable: LoopVariable,
        /// Its first value
        start: Affine,
        /// One past its last value
        end: Affine,
        /// What is repeated
        body: Vec<Statement>,
    },
    /// `output = value`, or `output += value`
    Store {
        /// Where to
        output: Place,
        /// What
        value: Operand,
        /// Add to what is there (the program has stored it before, or cleared the array: see [`Statement::Clear`])
        accumulate: bool,
    },
    /// Entries that follow from others: for k in 0..length, output (k, k), counted from the given one, becomes −Σ
    /// output (l, k) over l ≠ k, and so does its mirror image on the other side of the diagonal of the array
    Balance {
        /// The first of the entries
        output: Place,
        /// How many
        length: Affine,
    },
    /// Sets a whole array of results (all its entries) to zero, before loops scatter into it
    Clear {
        /// The array
        array: Array,
    },
}

impl Operation {
    fn operands(&self) -> Vec<&Operand> {
        match self {
            Self::Negate(a) | Self::IntegerPower(a, _) => vec![a],
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Power(a, b) => vec![a, b],
            Self::Call(_, arguments) => arguments.iter().collect(),
            Self::Select {
                left,
                right,
                then,
                otherwise,
                ..
            } => vec![left, right, then, otherwise],
        }
    }

    fn operands_mut(&mut self) -> Vec<&mut Operand> {
        match self {
            Self::Negate(a) | Self::IntegerPower(a, _) => vec![a],
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Power(a, b) => vec![a, b],
            Self::Call(_, arguments) => arguments.iter_mut().collect(),
            Self::Select {
                left,
                right,
                then,
                otherwise,
                ..
            } => vec![left, right, then, otherwise],
        }
    }
}

impl Statement {
    /// What it reads; of a loop, nothing.
    pub fn operands(&self) -> Vec<&Operand> {
        match self {
            Self::Let { operation, .. } => operation.operands(),
            Self::SineCosine {
                argument: value, ..
            }
            | Self::Accumulator { start: value, .. }
            | Self::Accumulate { value, .. }
            | Self::Assign { value, .. }
            | Self::Store { value, .. } => vec![value],
            Self::Loop { .. } | Self::Balance { .. } | Self::Clear { .. } => Vec::new(),
        }
    }

    /// Goes through the temporaries that it reads and then those that it sets; of a loop, none.
    pub(crate) fn for_each_temporary(&mut self, change: &mut impl FnMut(&mut Temporary)) {
        let (operands, targets) = match self {
            Self::Let { target, operation } => (operation.operands_mut(), vec![target]),
            Self::SineCosine {
                sine,
                cosine,
                argument,
            } => (vec![argument], vec![sine, cosine]),
            Self::Accumulator {
                target,
                start: value,
            }
            | Self::Accumulate { target, value }
            | Self::Assign { target, value } => (vec![value], vec![target]),
            Self::Store { value, .. } => (vec![value], Vec::new()),
            Self::Loop { .. } | Self::Balance { .. } | Self::Clear { .. } => return,
        };
        for operand in operands {
            if let Operand::Temporary(temporary) = operand {
                change(temporary);
            }
        }
        targets.into_iter().for_each(change);
    }
}

/// A program ready to be interpreted, printed or emitted.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Program {
    /// The steps, in order
    pub statements: Vec<Statement>,
    /// How many temporaries they use
    pub temporaries: u32,
}
