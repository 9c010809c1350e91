//! Lengths are numbers or names.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[N + 1]),
    lagrangian = m/2*dot(q[0])^2 - k/2*q[0]^2,
)]
struct Model<const N: usize> { m: f64, k: f64 }

fn main() {}
