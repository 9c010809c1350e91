//! A coordinate without inertia.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*dot(x)^2 - k/2*(x - y)^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
