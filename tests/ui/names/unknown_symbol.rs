//! A misspelt coordinate.

use tfe::prelude::*;

#[dynamics(
    coordinates(theta),
    lagrangian = m/2*dot(theta)^2 + k*cos(thta),
)]
struct Model { m: f64, k: f64 }

fn main() {}
