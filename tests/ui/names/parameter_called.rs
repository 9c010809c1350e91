//! A parameter is no function.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m(dot(x)^2) - k/2*x^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
