//! Outputs by site are for models of run-time length.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[3]),
    lagrangian = sum(i in 0..3, m/2*dot(q[i])^2 - k/2*q[i]^2),
    output(square[i in 0..3]) = q[i]^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
