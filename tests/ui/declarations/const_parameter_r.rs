//! A const parameter called like the scalar of the kernels.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[R]),
    lagrangian = sum(i in 0..R, m/2*dot(q[i])^2 - k/2*q[i]^2),
)]
struct Model<const R: usize> { m: f64, k: f64 }

fn main() {}
