//! A sum over nothing.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in n..n, m/2*q[0]^2),
)]
struct Chain { n: usize, m: f64 }

fn main() {}
