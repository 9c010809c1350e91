//! How many turns a sum has is not up to a list.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n, sum(j in 0..left[i], k*q[j]^2)),
)]
struct Network { n: usize, k: f64, left: Vec<usize> }

fn main() {}
