//! A momentum without velocity.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*dot(x)^2 + x*dot(y) - k/2*(x^2 + y^2),
)]
struct Model { m: f64, k: f64 }

fn main() {}
