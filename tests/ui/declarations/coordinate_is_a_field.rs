//! A name that is a parameter.

use tfe::prelude::*;

#[dynamics(
    coordinates(m),
    lagrangian = k/2*dot(m)^2 - m^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
