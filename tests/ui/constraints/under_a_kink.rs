//! A jump is not linear.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(way) = y + sign(dot(x)),
)]
struct Model { m: f64, g: f64 }

fn main() {}
