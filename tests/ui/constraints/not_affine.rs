//! Velocities stand linearly in a constraint.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(speed) = dot(x)^2 + x*dot(y) - 1,
)]
struct Model { m: f64, g: f64 }

fn main() {}
