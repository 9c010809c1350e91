//! Random models of four kinds, with parameters.

mod chains;
mod differences;
mod offsets;
mod quaternions;

use super::random::Random;
use super::writer::{Form, Model, Piece, Writer};

/// The kinds of models.
pub const KINDS: [&str; 4] = [DIFFERENCES, OFFSETS, CHAINS, QUATERNIONS];

const DIFFERENCES: &str = "differences";
const OFFSETS: &str = "offsets";
const CHAINS: &str = "chains";
const QUATERNIONS: &str = "quaternions";

const PARAMETERS: [&str; 5] = ["k", "l", "c", "m", "b"];

/// The kinds of ten models in a row: what is derived fast comes more often.
const TURNS: [&str; 10] = [
    DIFFERENCES,
    OFFSETS,
    CHAINS,
    QUATERNIONS,
    DIFFERENCES,
    OFFSETS,
    CHAINS,
    DIFFERENCES,
    OFFSETS,
    DIFFERENCES,
];

/// A model of the kind of its number.
pub fn model(random: &mut Random, number: usize) -> Model {
    match TURNS[number % TURNS.len()] {
        DIFFERENCES => differences::model(random),
        OFFSETS => offsets::model(random),
        CHAINS => chains::model(random),
        _ => quaternions::model(random),
    }
}

fn form(random: &mut Random) -> Form {
    if random.percent(25) {
        Form::Hamiltonian
    } else {
        Form::Lagrangian
    }
}

fn parameter(random: &mut Random, w: &mut Writer) -> Piece {
    w.parameter(random.pick(&PARAMETERS))
}

fn number(random: &mut Random, w: &mut Writer) -> Piece {
    let (digits, decimals) = random.pick(&[
        (2, 0),
        (3, 0),
        (5, 1),
        (15, 1),
        (3, 1),
        (7, 1),
        (25, 2),
        (1, 1),
    ]);
    w.decimal(digits, decimals)
}

/// A coefficient: a parameter, a number, or both.
fn scaled(random: &mut Random, w: &mut Writer, x: &Piece) -> Piece {
    match random.below(5) {
        0 => x.clone(),
        1 => {
            let c = number(random, w);
            w.multiply(&c, x)
        }
        2 => {
            let (c, two) = (parameter(random, w), w.integer(2));
            let half = w.divide(&c, &two);
            w.multiply(&half, x)
        }
        _ => {
            let c = parameter(random, w);
            w.multiply(&c, x)
        }
    }
}

fn plus_or_minus(random: &mut Random, w: &mut Writer, a: &Piece, b: &Piece) -> Piece {
    if random.percent(40) {
        w.add(a, b)
    } else {
        w.subtract(a, b)
    }
}

/// Σ z²/2, or with masses of their own.
fn kinetic(random: &mut Random, w: &mut Writer) -> Piece {
    let own = random.below(3);
    let mut terms = Vec::new();
    for at in 0..w.dof() {
        let z = w.z(at);
        let square = w.power(&z, 2);
        let term = match (own, w.form()) {
            (0, _) => square,
            (1, Form::Lagrangian) => {
                let m = w.parameter(["m", "b"][at % 2]);
                w.multiply(&m, &square)
            }
            (1, Form::Hamiltonian) => {
                let m = w.parameter(["m", "b"][at % 2]);
                w.divide(&square, &m)
            }
            _ => {
                let m = w.parameter("m");
                w.multiply(&m, &square)
            }
        };
        terms.push(term);
    }
    let (sum, two) = (w.sum(&terms), w.integer(2));
    w.divide(&sum, &two)
}
