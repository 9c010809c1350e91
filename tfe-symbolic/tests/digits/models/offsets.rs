//! Sums of large offsets: nested, with numbers and parameters.

use super::super::random::Random;
use super::super::scalar::Function;
use super::super::writer::{Model, Piece, Writer};
use super::differences::{complete, further};
use super::{OFFSETS, form, kinetic, number, parameter, plus_or_minus, scaled};

pub fn model(random: &mut Random) -> Model {
    let names = ["x", "y", "z", "w"];
    let n = 2 + random.below(3);
    let form = form(random);
    let mut writer = Writer::new(OFFSETS, form, &names[..n]);
    let w = &mut writer;
    let mut energy = kinetic(random, w);
    if random.percent(50) {
        let speed = sum(random, w, 2, true);
        let square = w.power(&speed, 2);
        let term = scaled(random, w, &square);
        energy = w.add(&energy, &term);
    }
    for _ in 0..1 + random.below(3) {
        let term = function(random, w);
        let term = scaled(random, w, &term);
        energy = plus_or_minus(random, w, &energy, &term);
    }
    if random.percent(20) {
        let value = sum(random, w, 3, false);
        w.output(&value);
    }
    if random.percent(20) {
        let value = sum(random, w, 2, false);
        let force = scaled(random, w, &value);
        w.force(0, &force);
    }
    further(random, w);
    let energy = complete(random, w, energy);
    writer.finish(&energy)
}

/// A sum of coordinates or velocities, parameters and numbers, written in any nesting.
fn sum(random: &mut Random, w: &mut Writer, depth: usize, of_velocities: bool) -> Piece {
    if depth == 0 || random.percent(15) {
        let at = random.below(w.dof());
        return match random.below(8) {
            0 => parameter(random, w),
            1 if depth == 0 => number(random, w),
            _ if of_velocities => w.z(at),
            _ => w.q(at),
        };
    }
    let a = sum(random, w, depth - 1, of_velocities);
    let b = sum(random, w, depth - 1, of_velocities);
    if a.id == b.id {
        return a;
    }
    // Mostly differences, and as many signs of both kinds.
    if random.percent(25) {
        w.add(&a, &b)
    } else {
        w.subtract(&a, &b)
    }
}

fn function(random: &mut Random, w: &mut Writer) -> Piece {
    let depth = 2 + random.below(2);
    let s = sum(random, w, depth, false);
    match random.below(7) {
        0..=2 => w.power(&s, 2),
        3 => w.power(&s, 3),
        4 => {
            let other = sum(random, w, 2, false);
            w.multiply(&s, &other)
        }
        5 => {
            let size = w.call(Function::Abs, &s);
            w.multiply(&size, &s)
        }
        _ => {
            let (q, square) = (w.q(0), w.power(&s, 2));
            w.multiply(&q, &square)
        }
    }
}
