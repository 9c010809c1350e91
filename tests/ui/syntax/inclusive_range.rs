//! Ranges exclude their end.

use tfe::prelude::*;

#[dynamics(
    coordinates(x[3]),
    lagrangian = m/2*sum(i in 0..=2, dot(x[i])^2) - k/2*x[0]^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
