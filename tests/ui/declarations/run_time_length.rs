//! Run-time lengths are not there yet.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2 - k/2*q[i]^2),
)]
struct Model { n: usize, m: f64, k: f64 }

fn main() {}
