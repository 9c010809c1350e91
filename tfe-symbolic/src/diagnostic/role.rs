//! What names stand for, in messages.

use std::fmt;

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A generalized coordinate.
    Coordinate,
    /// A momentum.
    Momentum,
    /// A field of the struct.
    Field,
    /// A const parameter of the struct.
    ConstParameter,
    /// An input.
    Input,
    /// A `let`.
    Let,
    /// The index of a sum.
    Index,
    /// An output.
    Output,
    /// A constraint.
    Constraint,
    /// A solver.
    Solver,
    /// A model made from this one.
    Model,
    /// The struct itself.
    Struct,
    /// A method that every model has.
    Method,
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Coordinate => "a coordinate",
            Self::Momentum => "a momentum",
            Self::Field => "a field of the struct",
            Self::ConstParameter => "a const parameter of the struct",
            Self::Input => "an input",
            Self::Let => "a `let`",
            Self::Index => "the index of an enclosing sum",
            Self::Output => "an output",
            Self::Constraint => "a constraint",
            Self::Solver => "a solver",
            Self::Model => "a model made from this one",
            Self::Struct => "the struct",
            Self::Method => "a method of every model",
        })
    }
}
