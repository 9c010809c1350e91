//! A coordinate that is misspelt.

use tfe::prelude::*;

#[dynamics(
    coordinates(theta),
    lagrangian = m/2*dot(theta)^2 + k*cos(theta),
    model(Near, truncated(2, thet = 1)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
