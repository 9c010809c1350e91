//! A function without arguments.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k*sin,
)]
struct Model { m: f64, k: f64 }

fn main() {}
