//! A family with too many members.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(pin[i in 0..100_000]) = x - i,
)]
struct Model { m: f64, g: f64 }

fn main() {}
