//! A length that is no const parameter.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[M]),
    lagrangian = m/2*sum(i in 0..N, dot(q[i])^2) - k/2*q[0]^2,
)]
struct Model<const N: usize> { m: f64, k: f64 }

fn main() {}
