//! Rigid bodies by quaternions: quadratic forms of their rates, rotated vectors.

use super::super::random::Random;
use super::super::writer::{Model, Piece, Writer};
use super::QUATERNIONS;

pub fn model(random: &mut Random) -> Model {
    let free = random.percent(30);
    let arrays: &[(&str, usize)] = if free {
        &[("e", 4), ("r", 3)]
    } else {
        &[("e", 4)]
    };
    let mut writer = Writer::with_arrays(QUATERNIONS, arrays);
    let w = &mut writer;
    let rates = body_rate(w);
    let mut energy = rotation(random, w, &rates);
    if free {
        for at in 4..7 {
            let (m, v, two) = (w.parameter("m"), w.z(at), w.integer(2));
            let (half, square) = (w.divide(&m, &two), w.power(&v, 2));
            let term = w.multiply(&half, &square);
            energy = w.add(&energy, &term);
        }
    }
    let arm: Vec<Piece> = match random.below(3) {
        0 => vec![w.integer(0), w.integer(0), w.parameter("l")],
        1 => vec![w.parameter("l"), w.integer(0), w.integer(0)],
        _ => vec![w.parameter("l"), w.parameter("h"), w.parameter("b")],
    };
    let ends = rotate(w, &arm);
    let potential = match random.below(4) {
        0 | 1 => {
            let (m, g) = (w.parameter("m"), w.parameter("g"));
            let weight = w.multiply(&m, &g);
            w.multiply(&weight, &ends[2])
        }
        2 => {
            let (k, c) = (w.parameter("k"), w.parameter("c"));
            let stretch = w.subtract(&ends[0], &c);
            let square = w.power(&stretch, 2);
            w.multiply(&k, &square)
        }
        _ => {
            let k = w.parameter("k");
            let square = w.power(&ends[1], 2);
            w.multiply(&k, &square)
        }
    };
    energy = w.subtract(&energy, &potential);
    if random.percent(60) {
        let squares: Vec<Piece> = (0..4)
            .map(|at| {
                let e = w.q(at);
                w.power(&e, 2)
            })
            .collect();
        let (sum, one) = (w.sum(&squares), w.integer(1));
        let value = w.subtract(&sum, &one);
        w.constraint(&value);
    }
    if free && random.percent(50) {
        let (r, along) = (w.q(4), &ends[0]);
        let value = w.add(&r, along);
        w.output(&value);
    }
    if random.percent(20) {
        let value = rates[0].clone();
        w.output(&value);
    }
    writer.finish(&energy)
}

/// 2 (e₀ ė⃗ − ė₀ e⃗ − e⃗ × ė⃗)
fn body_rate(w: &mut Writer) -> Vec<Piece> {
    let (e, v): (Vec<Piece>, Vec<Piece>) = (0..4).map(|at| (w.q(at), w.z(at))).unzip();
    let two = w.integer(2);
    let mut rates = Vec::new();
    for k in 0..3 {
        let (i, j) = (1 + (k + 1) % 3, 1 + (k + 2) % 3);
        let (forward, backward) = (w.multiply(&e[0], &v[k + 1]), w.multiply(&v[0], &e[k + 1]));
        let (plus, minus) = (w.multiply(&e[i], &v[j]), w.multiply(&e[j], &v[i]));
        let cross = w.subtract(&plus, &minus);
        let difference = w.subtract(&forward, &backward);
        let difference = w.subtract(&difference, &cross);
        rates.push(w.multiply(&two, &difference));
    }
    w.vector("w", "body_rate(e)", &rates)
}

/// (e₀² − |e⃗|²) r + 2 ((e⃗·r) e⃗ + e₀ e⃗ × r)
fn rotate(w: &mut Writer, r: &[Piece]) -> Vec<Piece> {
    let e: Vec<Piece> = (0..4).map(|at| w.q(at)).collect();
    let two = w.integer(2);
    let squares: Vec<Piece> = e.iter().map(|x| w.power(x, 2)).collect();
    let axis = w.sum(&squares[1..]);
    let along = w.subtract(&squares[0], &axis);
    let products: Vec<Piece> = (0..3).map(|k| w.hidden_product(&e[k + 1], &r[k])).collect();
    let projection = w.hidden_sum(&products);
    let mut ends = Vec::new();
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let plus = w.hidden_product(&e[i + 1], &r[j]);
        let minus = w.hidden_product(&e[j + 1], &r[i]);
        let turned = w.hidden_difference(&plus, &minus);
        let plain = w.hidden_product(&along, &r[k]);
        let projected = w.hidden_product(&projection, &e[k + 1]);
        let turned = w.hidden_product(&e[0], &turned);
        let both = w.hidden_sum(&[projected, turned]);
        let twice = w.hidden_product(&two, &both);
        ends.push(w.hidden_sum(&[plain, twice]));
    }
    let text: Vec<&str> = r.iter().map(|r| &*r.text).collect();
    let text = format!("rotate(e, [{}])", text.join(", "));
    w.vector("u", &text, &ends)
}

/// Quadratic forms of the rates, about principal axes and others.
fn rotation(random: &mut Random, w: &mut Writer, rates: &[Piece]) -> Piece {
    let symmetric = random.percent(30);
    let mut terms = Vec::new();
    for (k, rate) in rates.iter().enumerate() {
        let name = match (symmetric, k) {
            (true, 1) => "i1",
            _ => ["i1", "i2", "i3"][k],
        };
        let (inertia, square) = (w.parameter(name), w.power(rate, 2));
        terms.push(w.multiply(&inertia, &square));
    }
    let (sum, two) = (w.sum(&terms), w.integer(2));
    let mut energy = w.divide(&sum, &two);
    match random.below(5) {
        0 => {
            let product = w.parameter("p");
            let product = w.multiply(&product, &rates[0]);
            let product = w.multiply(&product, &rates[1]);
            energy = w.add(&energy, &product);
        }
        1 => {
            let relative = w.subtract(&rates[0], &rates[2]);
            let (square, p) = (w.power(&relative, 2), w.parameter("p"));
            let term = w.multiply(&p, &square);
            energy = w.add(&energy, &term);
        }
        2 => {
            let spin = w.parameter("s");
            let relative = w.subtract(&rates[2], &spin);
            let (square, p) = (w.power(&relative, 2), w.parameter("p"));
            let term = w.multiply(&p, &square);
            energy = w.add(&energy, &term);
        }
        _ => {}
    }
    energy
}
