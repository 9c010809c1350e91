//! Declarations that once made the engine or the macro panic, each as small as it could be made.

use super::pipeline::Outcome::{self, Accepted, Rejected};
use super::{Declaration, structs};

/// Struct, arguments, and what becomes of them in the engine.
const CASES: &[(&str, &str, Outcome)] = &[
    // Words that cannot be raw identifiers.
    (
        "",
        "coordinates(x), lagrangian = dot(x)^2, output(crate) = x",
        Rejected,
    ),
    (
        "",
        "coordinates(x), lagrangian = dot(x)^2, output(self) = x",
        Rejected,
    ),
    (
        "",
        "coordinates(x), lagrangian = dot(x)^2, output(super) = x",
        Rejected,
    ),
    (
        "",
        "coordinates(x), lagrangian = dot(x)^2, output(Self) = x",
        Rejected,
    ),
    // One point less than no node.
    (
        "",
        "coordinates(x, y), lagrangian = dot(x)^2 + dot(y)^2, constraint(c) = x - y^2, solver(S, Primal::<0>.reduced())",
        Rejected,
    ),
    // An exponent without an opposite.
    (
        "a, b",
        "coordinates(x), lagrangian = dot(x)^2 + x*(a - b^-2147483648)^1.5",
        Accepted,
    ),
];

/// All of them.
pub fn all() -> Vec<(Declaration, Outcome)> {
    let case = |(fields, arguments, outcome): &(&str, &str, Outcome)| {
        let declaration = Declaration {
            context: structs::context(fields),
            arguments: (*arguments).to_owned(),
        };
        (declaration, *outcome)
    };
    CASES.iter().map(case).collect()
}
