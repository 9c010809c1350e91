//! A power whose base may be negative.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^x,
)]
struct Model { m: f64, k: f64 }

fn main() {}
