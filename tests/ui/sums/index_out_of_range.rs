//! The last neighbour is missing.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, m/2*dot(q[i])^2 - k/2*(q[i+1] - q[i])^2),
)]
struct Model<const N: usize> { m: f64, k: f64 }

fn main() {}
