//! Indices are affine.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[9]),
    lagrangian = sum(i in 0..9, m/2*dot(q[i])^2) - k*sum(i in 0..3, q[i*i]),
)]
struct Model { m: f64, k: f64 }

fn main() {}
