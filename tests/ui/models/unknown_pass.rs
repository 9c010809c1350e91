//! A pass that does not exist.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    model(Linear, truncate(2)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
