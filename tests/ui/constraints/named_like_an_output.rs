//! Constraints and outputs stand side by side in results.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    output(rod) = x,
    constraint(rod) = x^2 + y^2 - 1,
)]
struct Model { m: f64, g: f64 }

fn main() {}
