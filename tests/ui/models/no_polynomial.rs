//! A truncation at a singularity.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 + k/x,
    model(Near, truncated(2)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
