//! A sum in a constraint is written out.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, m/2*dot(q[i])^2),
    constraint(whole) = sum(i in 0..N, q[i]^2) - l^2,
)]
struct Model<const N: usize> { m: f64, l: f64 }

fn main() {}
