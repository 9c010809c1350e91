//! Words for declarations: usual ones, and those that may be confused with others.

use super::random::Random;

/// Keywords of Rust that may be raw identifiers.
pub const KEYWORDS: &[&str] = &[
    "type", "fn", "match", "async", "impl", "move", "ref", "yield", "box", "gen", "try", "where",
    "loop", "if", "abstract",
];

/// Keywords of Rust that may not, and words with a meaning of their own.
const RESERVED: &[&str] = &[
    "crate",
    "self",
    "super",
    "Self",
    "_",
    "t",
    "pi",
    "dot",
    "sum",
    "select",
    "in",
    "let",
    "sin",
    "inner",
    "model",
    "force",
    "state",
    "structure",
    "of",
    "state_at",
    "__tfe_q",
    "__tfe",
    "coordinates",
    "lagrangian",
    "truncated",
    "p_t",
];

/// Names that generated code may use for something of its own.
const GENERATED: &[&str] = &[
    "R", "N", "f64", "first", "second", "values", "q", "z", "t0", "t1", "index", "self_", "i",
    "core", "Some", "original", "mu", "row", "tau", "R0", "usize", "by", "time", "clone", "mass",
];

/// Names with letters outside of ASCII.
const FOREIGN: &[&str] = &[
    "θ",
    "φ_1",
    "λ",
    "ẋ",
    "Ω",
    "длина",
    "長さ",
    "ǆ",
    "é",
    "q̈",
    "ℓ",
    "µ",
    "µ2",
    "ᾱ",
    "x\u{301}",
];

/// Names of coordinates.
pub const COORDINATES: &[&str] = &[
    "x",
    "y",
    "z",
    "q",
    "theta",
    "phi",
    "psi",
    "r",
    "s",
    "e",
    "u",
    "theta1",
    "theta2",
    "x_1",
    "alpha_beta",
    "w",
];

/// Names of parameters.
pub const PARAMETERS: &[&str] = &[
    "m",
    "k",
    "l",
    "g",
    "c",
    "omega",
    "a",
    "b",
    "m1",
    "m2",
    "l1",
    "l2",
    "kappa",
    "j",
    "mu",
    "eps",
    "radius",
    "x0",
    "_d",
    "a1b",
    "stiffness_of_spring",
];

/// Names of `let`s, outputs, constraints and models.
pub const OTHERS: &[&str] = &[
    "h", "f", "rod", "pin", "tip_x", "v1", "energy", "w1", "Fast", "Small", "Other", "A", "lx",
    "ly", "body", "d2",
];

/// A name from the list, now and then one that is easily confused.
pub fn name(random: &mut Random, usual: &[&str]) -> String {
    let list = match random.weighted(&[930, 20, 2, 18, 30]) {
        0 => usual,
        1 => KEYWORDS,
        2 => RESERVED,
        3 => GENERATED,
        _ => FOREIGN,
    };
    (*random.pick(list)).to_owned()
}

/// Numbers at the ends of their types, and others that are easily read wrongly.
const NUMBERS: &[&str] = &[
    "0",
    "0.0",
    "1",
    "1e308",
    "1e-308",
    "4.9e-324",
    "1.7976931348623157e308",
    "1e309",
    "2147483647",
    "2147483648",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551616",
    "0.1",
    "0.30000000000000004",
    "3.141592653589793238462643383279502884197169399375105820974944592307",
    "123456789012345678901234567890",
    "1e-400",
    "1_000_000",
    "1.",
    "1e+2",
    "1e_3",
    "00012",
    "0.5e1",
    "1e15",
    "9007199254740993",
    "0.333333333333333333333333333333333333333",
    "1e100",
    "4294967296",
    "1e-16",
    "170141183460469231731687303715884105727",
    "1E5",
    "12.5",
    "65536",
    "1e18",
    "3e-5",
];

/// Usual numbers.
const SMALL: &[&str] = &[
    "1", "2", "3", "4", "0.5", "1.5", "9.81", "0.1", "10", "1e-3", "7", "6", "0.25",
];

/// A number, now and then an extreme one.
pub fn number(random: &mut Random) -> String {
    let list = match random.per_mille(60) {
        true => NUMBERS,
        false => SMALL,
    };
    (*random.pick(list)).to_owned()
}

/// An exponent.
pub fn exponent(random: &mut Random) -> String {
    let usual = [
        "2", "2", "2", "2", "3", "4", "-1", "-2", "0.5", "1.5", "(1/2)", "(-3/2)", "(1/3)",
    ];
    let extreme = [
        "0",
        "1",
        "-0",
        "12",
        "20",
        "100",
        "-2147483648",
        "2147483647",
        "(-2147483647)",
        "1e308",
        "1e-308",
        "(2147483647/2)",
        "(1/2147483647)",
        "-7",
        "(2/3)",
        "pi",
        "65537",
        "(-5/2)",
        "2^3",
        "2147483648",
        "4294967296",
        "9223372036854775807",
        "(-9223372036854775807)",
        "(1/9223372036854775807)",
        "1e20",
        "0.1",
        "0.30000000000000004",
        "(4/2)",
        "1000000",
    ];
    let list = match random.per_mille(60) {
        true => extreme.as_slice(),
        false => usual.as_slice(),
    };
    (*random.pick(list)).to_owned()
}
