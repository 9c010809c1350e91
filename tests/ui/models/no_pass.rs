//! A model made by nothing.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    model(Same),
)]
struct Model { m: f64, k: f64 }

fn main() {}
