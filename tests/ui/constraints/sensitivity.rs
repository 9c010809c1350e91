//! A constraint cannot be differentiated by its parameters.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
    sensitivity(g, l),
)]
struct Model { m: f64, g: f64, l: f64 }

fn main() {}
