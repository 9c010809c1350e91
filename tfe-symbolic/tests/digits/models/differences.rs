//! Polynomials and functions of differences: of coordinates, of coordinates and parameters, of velocities.

use super::super::formula::Comparison;
use super::super::random::Random;
use super::super::scalar::Function;
use super::super::writer::{Form, Model, Piece, Writer};
use super::{DIFFERENCES, form, kinetic, number, parameter, plus_or_minus, scaled};

pub fn model(random: &mut Random) -> Model {
    let names = ["x", "y", "z", "w"];
    let n = 2 + random.below(3);
    let form = form(random);
    let mut writer = Writer::new(DIFFERENCES, form, &names[..n]);
    let w = &mut writer;
    let mut energy = kinetic(random, w);
    if random.percent(50) {
        let extra = moving(random, w);
        energy = w.add(&energy, &extra);
    }
    for _ in 0..1 + random.below(3) {
        let term = function(random, w);
        let term = scaled(random, w, &term);
        energy = plus_or_minus(random, w, &energy, &term);
    }
    further(random, w);
    let energy = complete(random, w, energy);
    writer.finish(&energy)
}

/// Most coordinates that the energy does not hold get a spring.
pub fn complete(random: &mut Random, w: &mut Writer, mut energy: Piece) -> Piece {
    for at in 0..w.dof() {
        if !w.holds_coordinate(&energy, at) && random.percent(70) {
            let (q, l) = (w.q(at), parameter(random, w));
            let difference = w.subtract(&q, &l);
            let square = w.power(&difference, 2);
            let spring = scaled(random, w, &square);
            energy = w.subtract(&energy, &spring);
        }
    }
    energy
}

/// A difference of two things of one size.
pub fn difference(random: &mut Random, w: &mut Writer) -> Piece {
    let n = w.dof();
    let i = random.below(n);
    let j = (i + 1 + random.below(n - 1)) % n;
    let (a, b) = (w.q(i), w.q(j));
    match random.below(10) {
        0..=4 => w.subtract(&a, &b),
        5 | 6 => {
            let l = parameter(random, w);
            w.subtract(&a, &l)
        }
        7 => {
            let (l, size) = (parameter(random, w), w.call(Function::Abs, &a));
            w.subtract(&size, &l)
        }
        8 => {
            let l = parameter(random, w);
            let difference = w.subtract(&a, &b);
            w.subtract(&difference, &l)
        }
        _ => {
            let number = number(random, w);
            let difference = w.subtract(&a, &b);
            plus_or_minus(random, w, &difference, &number)
        }
    }
}

/// A function of differences.
pub fn function(random: &mut Random, w: &mut Writer) -> Piece {
    let d = difference(random, w);
    match random.below(15) {
        0..=2 => w.power(&d, 2),
        3 => w.power(&d, 3),
        4 => w.power(&d, 4),
        5 => {
            let (c, square) = (parameter(random, w), w.power(&d, 2));
            let c2 = w.power(&c, 2);
            let sum = w.add(&square, &c2);
            w.call(Function::Sqrt, &sum)
        }
        6 => {
            let square = w.power(&d, 2);
            let minus = w.negate(&square);
            w.call(Function::Exp, &minus)
        }
        7 => {
            let (square, cube, zero) = (w.power(&d, 2), w.power(&d, 3), w.integer(0));
            let (then, otherwise) = (scaled(random, w, &square), scaled(random, w, &cube));
            let comparison = random.pick(&[Comparison::Less, Comparison::Greater]);
            w.select(comparison, (&d, &zero), (&then, &otherwise))
        }
        8 => {
            let (c, square) = (parameter(random, w), w.power(&d, 2));
            let c2 = w.power(&c, 2);
            let below = w.add(&square, &c2);
            let one = w.integer(1);
            w.divide(&one, &below)
        }
        9 => {
            let other = difference(random, w);
            w.multiply(&d, &other)
        }
        10 => {
            let other = difference(random, w);
            let (a, b) = (w.power(&d, 2), w.power(&other, 2));
            w.multiply(&a, &b)
        }
        11 => distance(random, w, &d),
        13 => {
            let (one, square) = (w.integer(1), w.power(&d, 2));
            let sum = w.add(&one, &square);
            w.call(Function::Ln, &sum)
        }
        12 => {
            let size = w.call(Function::Abs, &d);
            let l = parameter(random, w);
            let rest = w.subtract(&size, &l);
            w.power(&rest, 2)
        }
        _ => {
            // Written out by the user.
            let n = w.dof();
            let i = random.below(n);
            let (a, b, two) = (w.q(i), w.q((i + 1) % n), w.integer(2));
            let (a2, b2) = (w.power(&a, 2), w.power(&b, 2));
            let twice = w.multiply(&two, &a);
            let mixed = w.multiply(&twice, &b);
            let sum = w.add(&a2, &b2);
            w.subtract(&sum, &mixed)
        }
    }
}

/// (√(d² + e²) − l)²
fn distance(random: &mut Random, w: &mut Writer, d: &Piece) -> Piece {
    let (e, l) = (difference(random, w), parameter(random, w));
    let (d2, e2) = (w.power(d, 2), w.power(&e, 2));
    let sum = w.add(&d2, &e2);
    let length = w.call(Function::Sqrt, &sum);
    let stretch = w.subtract(&length, &l);
    w.power(&stretch, 2)
}

/// Differences among velocities, and masses that differences make.
fn moving(random: &mut Random, w: &mut Writer) -> Piece {
    let n = w.dof();
    let i = random.below(n);
    let j = (i + 1 + random.below(n - 1)) % n;
    let (zi, zj) = (w.z(i), w.z(j));
    let relative = w.subtract(&zi, &zj);
    let term = match random.below(5) {
        0 | 1 => w.power(&relative, 2),
        2 => {
            let (d, square) = (difference(random, w), w.power(&zi, 2));
            let d2 = w.power(&d, 2);
            w.multiply(&d2, &square)
        }
        3 => {
            let (qi, qj) = (w.q(i), w.q(j));
            let (left, right) = (w.multiply(&qi, &zj), w.multiply(&qj, &zi));
            let momentum = w.subtract(&left, &right);
            w.power(&momentum, 2)
        }
        _ => {
            let d = difference(random, w);
            let product = w.multiply(&d, &relative);
            w.power(&product, 2)
        }
    };
    scaled(random, w, &term)
}

/// Forces, dissipation, outputs, a constraint.
pub fn further(random: &mut Random, w: &mut Writer) {
    let n = w.dof();
    let lagrangian = w.form() == Form::Lagrangian;
    if random.percent(20) {
        let (i, j) = (random.below(n), random.below(n));
        let value = if lagrangian && random.percent(50) {
            let (zi, zj) = (w.z(i), w.z(j));
            if i == j { zi } else { w.subtract(&zi, &zj) }
        } else {
            let d = difference(random, w);
            w.power(&d, 3)
        };
        let (c, minus) = (parameter(random, w), w.negate(&value));
        let force = w.multiply(&c, &minus);
        w.force(i, &force);
    }
    if lagrangian && random.percent(15) {
        let (zi, zj) = (w.z(0), w.z(1));
        let relative = w.subtract(&zi, &zj);
        let square = w.power(&relative, 2);
        let mut dissipation = scaled(random, w, &square);
        if random.percent(40) {
            let d = difference(random, w);
            let d2 = w.power(&d, 2);
            dissipation = w.multiply(&dissipation, &d2);
        }
        w.dissipation(&dissipation);
    }
    if random.percent(20) {
        let value = function(random, w);
        w.output(&value);
    }
    if random.percent(20) && n > 2 {
        constraint(random, w);
    }
}

fn constraint(random: &mut Random, w: &mut Writer) {
    let (x, y) = (w.q(0), w.q(1));
    let value = if random.percent(60) {
        let (d, z, l) = (w.subtract(&x, &y), w.q(2), parameter(random, w));
        let e = w.subtract(&z, &x);
        let (d2, e2, l2) = (w.power(&d, 2), w.power(&e, 2), w.power(&l, 2));
        let sum = w.add(&d2, &e2);
        w.subtract(&sum, &l2)
    } else {
        let (d, vx, vz) = (w.subtract(&x, &y), w.velocity(0), w.velocity(2));
        let product = w.multiply(&d, &vz);
        w.subtract(&vx, &product)
    };
    w.constraint(&value);
}
