//! Nothing is divided by a vector.

use tfe::prelude::*;

#[dynamics(
    coordinates(r[3]),
    lagrangian = m/2*inner(dot(r), dot(r)) - k/r,
)]
struct Model { m: f64, k: f64 }

fn main() {}
