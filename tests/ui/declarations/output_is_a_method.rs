//! An output called like a method of every model.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    output(state) = x,
)]
struct Model { m: f64, k: f64 }

fn main() {}
