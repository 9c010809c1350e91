//! A misspelt coordinate under a force.

use tfe::prelude::*;

#[dynamics(
    coordinates(theta),
    lagrangian = m/2*dot(theta)^2 + k*cos(theta),
    force(thta) = sin(t),
)]
struct Model { m: f64, k: f64 }

fn main() {}
