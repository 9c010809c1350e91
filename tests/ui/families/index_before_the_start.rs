//! The first neighbour is missing, whatever the length.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m[i]/2*dot(q[i])^2 - k/2*(q[i] - q[i-1])^2),
)]
struct Chain { n: usize, m: Vec<f64>, k: f64 }

fn main() {}
