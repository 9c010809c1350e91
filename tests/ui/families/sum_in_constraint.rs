//! A sum over all sites makes a row that holds all coordinates.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2),
    constraint(centre) = sum(i in 0..n, m*q[i]),
)]
struct Chain { n: usize, m: f64 }

fn main() {}
