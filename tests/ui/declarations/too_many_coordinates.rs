//! More coordinates than the engine counts.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[100000]),
    lagrangian = m/2*dot(q[0])^2 - k/2*q[0]^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
