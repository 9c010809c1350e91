//! Constraints are not there yet.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - k*y,
    constraint(rod) = x^2 + y^2 - 1,
)]
struct Model { m: f64, k: f64 }

fn main() {}
