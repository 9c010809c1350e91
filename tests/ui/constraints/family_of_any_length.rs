//! A family needs a literal range.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, m/2*dot(q[i])^2),
    constraint(rod[i in 0..N-1]) = q[i+1] - q[i] - l,
)]
struct Model<const N: usize> { m: f64, l: f64 }

fn main() {}
