//! Vectors of different length.

use tfe::prelude::*;

#[dynamics(
    coordinates(r[3]),
    lagrangian = m/2*inner(dot(r), dot(r)) - k*inner(r, [1, 2]),
)]
struct Model { m: f64, k: f64 }

fn main() {}
