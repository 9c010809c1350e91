//! An element that is not there.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[3]),
    lagrangian = sum(i in 0..3, m/2*dot(q[i])^2) - k*q[3],
)]
struct Model { m: f64, k: f64 }

fn main() {}
