//! A field of another type.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2*name,
)]
struct Model { m: f64, k: f64, name: String }

fn main() {}
