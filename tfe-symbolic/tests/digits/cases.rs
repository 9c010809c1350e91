//! Models that have been seen to lose digits.

use super::scalar::Function;
use super::writer::{Form, Model, Piece, Writer};

const KIND: &str = "cases";

/// All of them.
pub fn cases() -> Vec<Model> {
    vec![
        springs_and_a_fourth_power(),
        squared_difference_as_mass(),
        spring_from_a_length(),
        squared_momentum(),
        two_springs(),
    ]
}

/// (v₀² + v₁²)/2
fn kinetic(w: &mut Writer) -> Piece {
    let squares: Vec<Piece> = (0..w.dof())
        .map(|at| {
            let v = w.z(at);
            w.power(&v, 2)
        })
        .collect();
    let (sum, two) = (w.sum(&squares), w.integer(2));
    w.divide(&sum, &two)
}

/// (ẋ² + ẏ²)/2 − k (|y| − l)² − c (x − y)⁴
fn springs_and_a_fourth_power() -> Model {
    let mut w = Writer::new(KIND, Form::Lagrangian, &["x", "y"]);
    let (x, y) = (w.q(0), w.q(1));
    let (k, l, c) = (w.parameter("k"), w.parameter("l"), w.parameter("c"));
    let kinetic = kinetic(&mut w);
    let stretch = w.call(Function::Abs, &y);
    let stretch = w.subtract(&stretch, &l);
    let square = w.power(&stretch, 2);
    let spring = w.multiply(&k, &square);
    let difference = w.subtract(&x, &y);
    let fourth = w.power(&difference, 4);
    let fourth = w.multiply(&c, &fourth);
    let energy = w.subtract(&kinetic, &spring);
    let energy = w.subtract(&energy, &fourth);
    w.finish(&energy)
}

/// (ẋ² + ẏ²)/2 + m (x − y)² ẋ²
fn squared_difference_as_mass() -> Model {
    let mut w = Writer::new(KIND, Form::Lagrangian, &["x", "y"]);
    let (x, y, m, vx) = (w.q(0), w.q(1), w.parameter("m"), w.z(0));
    let kinetic = kinetic(&mut w);
    let difference = w.subtract(&x, &y);
    let square = w.power(&difference, 2);
    let mass = w.multiply(&m, &square);
    let velocity_square = w.power(&vx, 2);
    let term = w.multiply(&mass, &velocity_square);
    let energy = w.add(&kinetic, &term);
    w.finish(&energy)
}

/// (q̇² + q² φ̇²)/2 − k (q − l)²/2
fn spring_from_a_length() -> Model {
    let mut w = Writer::new(KIND, Form::Lagrangian, &["q", "phi"]);
    let (q, k, l) = (w.q(0), w.parameter("k"), w.parameter("l"));
    let (vq, vphi, two) = (w.z(0), w.z(1), w.integer(2));
    let (vq2, q2, vphi2) = (w.power(&vq, 2), w.power(&q, 2), w.power(&vphi, 2));
    let turning = w.multiply(&q2, &vphi2);
    let kinetic = w.add(&vq2, &turning);
    let kinetic = w.divide(&kinetic, &two);
    let stretch = w.subtract(&q, &l);
    let square = w.power(&stretch, 2);
    let spring = w.multiply(&k, &square);
    let spring = w.divide(&spring, &two);
    let energy = w.subtract(&kinetic, &spring);
    w.finish(&energy)
}

/// (ẋ² + ẏ²)/2 + k (x ẏ − y ẋ)²
fn squared_momentum() -> Model {
    let mut w = Writer::new(KIND, Form::Lagrangian, &["x", "y"]);
    let (x, y, k) = (w.q(0), w.q(1), w.parameter("k"));
    let (vx, vy) = (w.z(0), w.z(1));
    let kinetic = kinetic(&mut w);
    let (left, right) = (w.multiply(&x, &vy), w.multiply(&y, &vx));
    let momentum = w.subtract(&left, &right);
    let square = w.power(&momentum, 2);
    let square = w.multiply(&k, &square);
    let energy = w.add(&kinetic, &square);
    w.finish(&energy)
}

/// (ẋ² + ẏ²)/2 − k (x − l)²/2 − c (y − x − l)²/2
fn two_springs() -> Model {
    let mut w = Writer::new(KIND, Form::Lagrangian, &["x", "y"]);
    let (x, y) = (w.q(0), w.q(1));
    let (k, l, c) = (w.parameter("k"), w.parameter("l"), w.parameter("c"));
    let mut energy = kinetic(&mut w);
    let first = w.subtract(&x, &l);
    let second = w.subtract(&y, &x);
    let second = w.subtract(&second, &l);
    for (stretch, stiffness) in [(first, k), (second, c)] {
        let (square, two) = (w.power(&stretch, 2), w.integer(2));
        let spring = w.multiply(&stiffness, &square);
        let spring = w.divide(&spring, &two);
        energy = w.subtract(&energy, &spring);
    }
    w.finish(&energy)
}
