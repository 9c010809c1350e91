//! An array of unknown length as a whole.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, m/2*dot(q[i])^2) - k*norm(q),
)]
struct Model<const N: usize> { m: f64, k: f64 }

fn main() {}
