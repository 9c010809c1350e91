//! A vector written out is indexed by numbers.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[20]),
    lagrangian = sum(i in 0..20, m/2*dot(q[i])^2 - k*[q[0], q[1]][i]),
)]
struct Model { m: f64, k: f64 }

fn main() {}
