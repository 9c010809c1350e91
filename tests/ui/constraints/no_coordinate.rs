//! A condition on parameters and the time is none on the motion.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
    constraint(length) = l - cos(t),
)]
struct Model { m: f64, g: f64, l: f64 }

fn main() {}
