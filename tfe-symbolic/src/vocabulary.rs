//! The words of the language, with its arguments in one table: what the parser, the checks, and the help of messages go by. May import
//! `expr` only.

pub mod element;

use crate::expr::function::Function;
pub use element::ELEMENTS;

/// The arguments of the attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument {
    /// `coordinates(a, q[3])`
    Coordinates,
    /// `momenta(pa, p[3])`
    Momenta,
    /// `input(u, w)`
    Input,
    /// `let name = value`
    Let,
    /// `lagrangian = value`
    Lagrangian,
    /// `hamiltonian = value`
    Hamiltonian,
    /// `time_transformation = rate`
    TimeTransformation,
    /// `force(a) = value`
    Force,
    /// `dissipation = value`
    Dissipation,
    /// `constraint(name) = value`
    Constraint,
    /// `output(name) = value`
    Output,
    /// `event(name) = value`: an output by another word
    Event,
    /// `sensitivity(k)`
    Sensitivity,
    /// `solver(Name, Mixed::<4>)`
    Solver,
    /// `model(Name, truncated(2))`
    Model,
    /// `crate = path`
    Crate,
}

/// How often an argument may stand.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Times {
    Once,
    Repeated,
}

/// What an argument declares.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Declares {
    /// Names that formulas use.
    Names,
    /// Nothing that formulas could refer to.
    Nothing,
}

/// The arguments with the words that they begin with.
const ARGUMENTS: [(Argument, &str, Times, Declares); 16] = [
    (
        Argument::Coordinates,
        "coordinates",
        Times::Once,
        Declares::Names,
    ),
    (Argument::Momenta, "momenta", Times::Once, Declares::Names),
    (Argument::Input, "input", Times::Repeated, Declares::Names),
    (Argument::Let, "let", Times::Repeated, Declares::Names),
    (
        Argument::Lagrangian,
        "lagrangian",
        Times::Once,
        Declares::Nothing,
    ),
    (
        Argument::Hamiltonian,
        "hamiltonian",
        Times::Once,
        Declares::Nothing,
    ),
    (
        Argument::TimeTransformation,
        "time_transformation",
        Times::Once,
        Declares::Nothing,
    ),
    (Argument::Force, "force", Times::Repeated, Declares::Nothing),
    (
        Argument::Dissipation,
        "dissipation",
        Times::Once,
        Declares::Nothing,
    ),
    (
        Argument::Constraint,
        "constraint",
        Times::Repeated,
        Declares::Nothing,
    ),
    (
        Argument::Output,
        "output",
        Times::Repeated,
        Declares::Nothing,
    ),
    (Argument::Event, "event", Times::Repeated, Declares::Nothing),
    (
        Argument::Sensitivity,
        "sensitivity",
        Times::Once,
        Declares::Nothing,
    ),
    (
        Argument::Solver,
        "solver",
        Times::Repeated,
        Declares::Nothing,
    ),
    (Argument::Model, "model", Times::Repeated, Declares::Nothing),
    (Argument::Crate, "crate", Times::Once, Declares::Nothing),
];

impl Argument {
    /// All of them, in the order in which messages list them.
    pub fn all() -> impl Iterator<Item = Self> {
        ARGUMENTS.iter().map(|(argument, ..)| *argument)
    }

    /// The argument that begins with a word.
    pub fn of_word(word: &str) -> Option<Self> {
        let mut rows = ARGUMENTS.iter();
        rows.find(|(_, own, ..)| *own == word)
            .map(|(argument, ..)| *argument)
    }

    /// The word that it begins with.
    pub fn word(self) -> &'static str {
        self.row().1
    }

    /// How it is written.
    pub fn form(self) -> &'static str {
        match self {
            Self::Coordinates => "coordinates(x, y)",
            Self::Momenta => "momenta(px, py)",
            Self::Input => "input(u)",
            Self::Let => "let name = …",
            Self::Lagrangian => "lagrangian = …",
            Self::Hamiltonian => "hamiltonian = …",
            Self::TimeTransformation => "time_transformation = …",
            Self::Force => "force(x) = …",
            Self::Dissipation => "dissipation = …",
            Self::Constraint => "constraint(name) = …",
            Self::Output => "output(name) = …",
            Self::Event => "event(name) = …",
            Self::Sensitivity => "sensitivity(m)",
            Self::Solver => "solver(Name, Mixed::<4>)",
            Self::Model => "model(Name, truncated(2))",
            Self::Crate => "crate = ::tfe",
        }
    }

    /// Whether it may stand once only.
    pub fn stands_once(self) -> bool {
        self.row().2 == Times::Once
    }

    /// Whether formulas can refer to names that it declares.
    pub fn declares_names(self) -> bool {
        self.row().3 == Declares::Names
    }

    fn row(self) -> &'static (Self, &'static str, Times, Declares) {
        // The table has the order of the variants, which a test makes sure of.
        &ARGUMENTS[self as usize]
    }
}

/// Functions that are no elementary functions, with their numbers of arguments.
pub const SPECIAL_FUNCTIONS: &[(&str, usize)] = &[
    ("dot", 1),
    ("sum", 2),
    ("select", 3),
    ("inner", 2),
    ("cross", 2),
    ("norm", 1),
    ("rotate", 2),
    ("body_rate", 1),
];

/// Whether formulas can call `name`.
pub fn is_function(name: &str) -> bool {
    function_names().any(|function| function == name)
}

/// The names of all functions.
pub fn function_names() -> impl Iterator<Item = &'static str> {
    let special = SPECIAL_FUNCTIONS.iter().map(|(name, _)| *name);
    special.chain(Function::ALL.into_iter().map(Function::name))
}

/// The rules of quadrature.
pub const RULES: &[&str] = &["reduced", "lobatto", "quadrature"];

/// The most points a rule can have.
pub const MAX_POINTS: u64 = 24;

/// What can be done to a model.
pub const PASSES: &[&str] = &["truncated", "frozen", "routh", "rigid", "elastic"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_the_order_of_the_variants() {
        for (at, argument) in Argument::all().enumerate() {
            assert_eq!(argument as usize, at);
            assert_eq!(Argument::of_word(argument.word()), Some(argument));
        }
    }
}
