//! A length that is no field.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[length]),
    lagrangian = sum(i in 0..length, m/2*dot(q[i])^2),
)]
struct Chain { n: usize, m: f64 }

fn main() {}
