//! A root of a sum couples all with all.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - k*sqrt(sum(i in 0..n, q[i]^2)),
)]
struct Chain { n: usize, m: f64, k: f64 }

fn main() {}
