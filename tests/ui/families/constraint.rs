//! Constraints need a number of coordinates.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2),
    constraint(rod[i in 0..n-1]) = q[i+1] - q[i] - l,
)]
struct Chain { n: usize, m: f64, l: f64 }

fn main() {}
