//! Trigonometric chains: by positions of their joints, by differences of angles, products of sines.

use super::super::random::Random;
use super::super::scalar::Function;
use super::super::writer::{Form, Model, Piece, Writer};
use super::{CHAINS, form, number, parameter, plus_or_minus, scaled};

const ANGLES: [&str; 3] = ["alpha", "beta", "gamma"];

pub fn model(random: &mut Random) -> Model {
    match random.below(3) {
        0 => by_positions(random),
        1 => by_differences(random),
        _ => products(random),
    }
}

fn sine(w: &mut Writer, angle: &Piece) -> Piece {
    w.call(Function::Sin, angle)
}

fn cosine(w: &mut Writer, angle: &Piece) -> Piece {
    w.call(Function::Cos, angle)
}

/// Joints one after the other, whose angles are absolute or relative; on a cart, or not.
fn by_positions(random: &mut Random) -> Model {
    let cart = random.percent(30);
    let links = 2 + random.below(2);
    let names = ANGLES[..links].iter().copied();
    let used: Vec<&str> = names.chain(cart.then_some("s")).collect();
    let relative = random.percent(50);
    let mut writer = Writer::new(CHAINS, Form::Lagrangian, &used);
    let w = &mut writer;
    let g = w.parameter("g");
    let mut angle: Option<Piece> = None;
    let mut joint: Option<(Piece, Piece)> = cart.then(|| (w.q(links), w.integer(0)));
    let mut energy: Option<Piece> = None;
    for link in 0..links {
        let q = w.q(link);
        let turned = match &angle {
            Some(before) if relative => w.add(before, &q),
            _ => q,
        };
        let length = w.parameter(["l1", "l2", "l3"][link]);
        let (s, c) = (sine(w, &turned), cosine(w, &turned));
        let (mut x, y) = (w.multiply(&length, &s), w.multiply(&length, &c));
        let mut y = w.negate(&y);
        if let Some((x0, y0)) = &joint {
            x = w.add(x0, &x);
            if !w.is_zero(y0) {
                y = w.add(y0, &y);
            }
        }
        let x = w.binding(&format!("x{link}"), &x);
        let y = w.binding(&format!("y{link}"), &y);
        let (vx, vy, two) = (w.rate(&x), w.rate(&y), w.integer(2));
        let (vx2, vy2) = (w.power(&vx, 2), w.power(&vy, 2));
        let square = w.add(&vx2, &vy2);
        let mass = w.parameter(["m1", "m2", "m1"][link]);
        let half = w.divide(&mass, &two);
        let kinetic = w.multiply(&half, &square);
        let weight = w.multiply(&mass, &g);
        let potential = w.multiply(&weight, &y);
        let sum = match &energy {
            Some(energy) => w.add(energy, &kinetic),
            None => kinetic,
        };
        energy = Some(w.subtract(&sum, &potential));
        angle = Some(turned);
        joint = Some((x, y));
    }
    let mut energy = energy.unwrap_or_else(|| g.clone());
    if cart {
        let v = w.z(links);
        let square = w.power(&v, 2);
        let term = w.multiply(&g, &square);
        energy = w.add(&energy, &term);
    }
    if random.percent(40) {
        let (a, b, k) = (w.q(0), w.q(1), w.parameter("k"));
        let difference = w.subtract(&a, &b);
        let square = w.power(&difference, 2);
        let spring = w.multiply(&k, &square);
        energy = w.subtract(&energy, &spring);
    }
    if let Some((x, y)) = &joint {
        match random.below(5) {
            0 => w.output(x),
            1 => w.constraint(y),
            2 => {
                let (k, l) = (w.parameter("k"), w.parameter("l"));
                let stretch = w.subtract(x, &l);
                let force = w.multiply(&k, &stretch);
                w.force(0, &force);
            }
            _ => {}
        }
    }
    writer.finish(&energy)
}

/// l₁ l₂ ȧ ḃ cos(a − b), and potentials of differences.
fn by_differences(random: &mut Random) -> Model {
    let n = 2 + random.below(2);
    let form = form(random);
    let mut writer = Writer::new(CHAINS, form, &ANGLES[..n]);
    let w = &mut writer;
    let mut energy = super::kinetic(random, w);
    for i in 0..n {
        let q = w.q(i);
        let cosine = cosine(w, &q);
        let term = scaled(random, w, &cosine);
        energy = plus_or_minus(random, w, &energy, &term);
        for j in 0..i {
            let (other, zi, zj) = (w.q(j), w.z(i), w.z(j));
            let mut difference = w.subtract(&q, &other);
            if random.percent(20) {
                let offset = parameter(random, w);
                difference = plus_or_minus(random, w, &difference, &offset);
            }
            let value = if random.percent(70) {
                self::cosine(w, &difference)
            } else {
                sine(w, &difference)
            };
            let value = if random.percent(15) {
                let d2 = w.power(&difference, 2);
                w.multiply(&d2, &value)
            } else {
                value
            };
            let value = if random.percent(20) {
                w.power(&value, 2)
            } else {
                value
            };
            let term = if random.percent(75) {
                let product = w.multiply(&zi, &zj);
                w.multiply(&product, &value)
            } else {
                value
            };
            let term = scaled(random, w, &term);
            energy = plus_or_minus(random, w, &energy, &term);
        }
    }
    if random.percent(25) {
        let (a, t, omega) = (w.q(0), w.time(), w.parameter("omega"));
        let phase = w.multiply(&omega, &t);
        let argument = w.subtract(&phase, &a);
        let force = sine(w, &argument);
        w.force(0, &force);
    }
    if form == Form::Lagrangian && random.percent(20) {
        let (zi, zj, c) = (w.z(0), w.z(1), w.parameter("c"));
        let difference = w.subtract(&zi, &zj);
        let square = w.power(&difference, 2);
        let dissipation = w.multiply(&c, &square);
        w.dissipation(&dissipation);
    }
    writer.finish(&energy)
}

/// Sums of products of sines and cosines of sums of angles.
fn products(random: &mut Random) -> Model {
    let n = 2 + random.below(2);
    let form = form(random);
    let mut writer = Writer::new(CHAINS, form, &ANGLES[..n]);
    let w = &mut writer;
    let mut energy = super::kinetic(random, w);
    for at in 0..2 + random.below(3) {
        let first = random.below(2) + at;
        let mut product = wave(random, w, first);
        for _ in 0..random.below(3) {
            let at = random.below(n);
            let factor = wave(random, w, at);
            product = w.multiply(&product, &factor);
        }
        if random.percent(50) {
            let (zi, zj) = (w.z(at % n), w.z((at + 1) % n));
            product = w.multiply(&product, &zi);
            product = w.multiply(&product, &zj);
        }
        let term = scaled(random, w, &product);
        energy = plus_or_minus(random, w, &energy, &term);
    }
    if random.percent(20) {
        let value = wave(random, w, 0);
        w.output(&value);
    }
    writer.finish(&energy)
}

/// A sine or cosine, perhaps squared, of an angle or a sum of some.
fn wave(random: &mut Random, w: &mut Writer, at: usize) -> Piece {
    let n = w.dof();
    let (a, b) = (w.q(at % n), w.q((at + 1) % n));
    let angle = match random.below(6) {
        0 => w.subtract(&a, &b),
        1 => w.add(&a, &b),
        2 => {
            let two = w.integer(2);
            w.multiply(&two, &a)
        }
        3 => {
            let offset = if random.percent(50) {
                parameter(random, w)
            } else {
                number(random, w)
            };
            plus_or_minus(random, w, &a, &offset)
        }
        _ => a,
    };
    let value = if random.percent(50) {
        sine(w, &angle)
    } else {
        cosine(w, &angle)
    };
    if random.percent(30) {
        w.power(&value, 2)
    } else {
        value
    }
}
