//! Straight-line programs with loops: what is emitted as Rust, and what the interpreter runs.
//!
//! CONTRACT between the engine (which schedules programs) and the emitter. The files of the folder count, run and print programs. May import
//! `expr` only.

pub mod count;
mod display;
pub mod interpret;

use crate::expr::function::Function;
use crate::expr::input::{Affine, Input, LoopVariable};
use crate::syntax::ast::Comparison;

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
    /// What the kernel is given.
    Input(Input),
}

/// One operation.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation {
    /// `a` itself
    Copy(Operand),
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
    /// `a` to an integer power that is not worth spelling out as products
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

/// Where a result goes. `z` is the velocity of a Lagrangian, the momentum of a Hamiltonian.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
    /// The energy function itself, L or H
    Value,
    /// ∂/∂z, one entry
    ByZ(Affine),
    /// ∂/∂q, one entry
    ByQ(Affine),
    /// Generalized force on one coordinate
    Force(Affine),
    /// ∂²/∂z∂z
    ZZ(Affine, Affine),
    /// ∂²/∂z∂q (row z, column q)
    ZQ(Affine, Affine),
    /// ∂²/∂q∂q
    QQ(Affine, Affine),
    /// ∂Q/∂z (row: coordinate of the force)
    ForceZ(Affine, Affine),
    /// ∂Q/∂q
    ForceQ(Affine, Affine),
    /// The observable of this number
    Observable(usize),
    /// φ of the constraint of this number
    Phi(usize),
    /// A, one entry of the row of a constraint
    Row(usize, Affine),
    /// a of a constraint
    Drift(usize),
    /// ∂ψ/∂q with ψ = A v + a, one entry of the row of a constraint
    PsiQ(usize, Affine),
    /// Ȧ, one entry of the row of a constraint
    RowRate(usize, Affine),
    /// ∂(Aᵀμ)/∂q
    Bend(Affine, Affine),
    /// ∂(Ȧᵀμ)/∂q
    RateQ(Affine, Affine),
    /// ∂(Ȧᵀμ)/∂v
    RateV(Affine, Affine),
    /// φ of one constraint of a model of run-time length
    SitePhi(Affine),
    /// A of a model of run-time length (row: constraint, column: coordinate)
    SiteRow(Affine, Affine),
    /// a of one constraint of a model of run-time length
    SiteDrift(Affine),
    /// An observable of a model of run-time length that has some by site
    SiteObservable(Affine),
}

impl Output {
    /// The entry so many rows and columns further; of all but the matrices of an energy, the entry itself.
    pub fn further(&self, rows: i64, columns: i64) -> Self {
        let sum = |index: &Affine, steps: i64| Affine {
            constant: index.constant.saturating_add(steps),
            ..index.clone()
        };
        self.mapped(|row, column| (sum(row, rows), sum(column, columns)))
    }

    /// The entry on the other side of the diagonal; of all but the matrices of an energy, the entry itself.
    pub fn transposed(&self) -> Self {
        self.mapped(|row, column| (column.clone(), row.clone()))
    }

    fn mapped(&self, change: impl Fn(&Affine, &Affine) -> (Affine, Affine)) -> Self {
        match self {
            Self::ZZ(row, column) => {
                let (row, column) = change(row, column);
                Self::ZZ(row, column)
            }
            Self::QQ(row, column) => {
                let (row, column) = change(row, column);
                Self::QQ(row, column)
            }
            other => other.clone(),
        }
    }
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
    /// `target = value`, inside the loop: what the next turn begins with
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
        output: Output,
        /// What
        value: Operand,
        /// Add to what is there (the program has stored it before, or cleared the array: see [`Statement::Clear`])
        accumulate: bool,
    },
    /// Entries that follow from others: output (k, k) for k in 0..length, counted from the one given, becomes −Σ output (l, k) over l ≠ k, and
    /// so does the one on the other side of the diagonal of the array
    Balance {
        /// The first of the entries
        output: Output,
        /// How many
        length: Affine,
    },
    /// Sets a whole array of results (all its entries) to zero, before loops scatter into it; the indices are ignored
    Clear {
        /// The array, named by any of its entries
        output: Output,
    },
}

impl Operation {
    fn operands(&self) -> Vec<&Operand> {
        match self {
            Self::Copy(a) | Self::Negate(a) | Self::IntegerPower(a, _) => vec![a],
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
            Self::Copy(a) | Self::Negate(a) | Self::IntegerPower(a, _) => vec![a],
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

/// What one kernel computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Request {
    /// L or H
    pub value: bool,
    /// First derivatives and forces
    pub first: bool,
    /// ∂²/∂z∂z (the mass matrix of a Lagrangian)
    pub mass: bool,
    /// All second derivatives and the derivatives of the forces
    pub second: bool,
    /// The observables
    pub observables: bool,
    /// φ of the holonomic constraints
    pub constraint_values: bool,
    /// A and a of the constraints
    pub constraint_rows: bool,
    /// The derivatives of the constraints, with velocities and multipliers
    pub constraint_second: bool,
}

/// By what the first derivatives and forces are differentiated once more, at fixed (q, z).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum By {
    /// The time
    Time,
    /// The parameter of this number in `sensitivity(…)`
    Parameter(usize),
}

/// A program ready to be interpreted, printed or emitted.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Program {
    /// The steps, in order
    pub statements: Vec<Statement>,
    /// How many temporaries they use
    pub temporaries: u32,
}
