//! A number plus a vector.

use tfe::prelude::*;

#[dynamics(
    coordinates(r[3]),
    lagrangian = m/2*inner(dot(r), dot(r)) - k*norm(r + 1),
)]
struct Model { m: f64, k: f64 }

fn main() {}
