//! What users of Rust write by habit.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    let square = |x| x^2,
    lagrangian = m/2*(x_dot^2 + dot(y)^2),
    force(x) = if x < 0 { -x } else { 0 },
    constraint(rod) = x^2 + y^2 = l^2,
    output(mass) = link.m,
    output(sine) = x.sin(),
    output(turned) = inner([x, y], [[0, 1], [1, 0]]),
)]
struct Model { m: f64, l: f64 }

fn main() {}
