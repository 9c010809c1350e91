//! A const-parameter array beside another coordinate.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, q[N]),
    lagrangian = m/2*dot(x)^2 - k/2*x^2 + sum(i in 0..N, dot(q[i])^2),
)]
struct Model<const N: usize> { m: f64, k: f64 }

fn main() {}
