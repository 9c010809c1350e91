//! `select` begins with a comparison.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*select(x, 1, 2),
)]
struct Model { m: f64, k: f64 }

fn main() {}
