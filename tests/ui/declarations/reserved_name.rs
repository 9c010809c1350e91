//! A name of the language.

use tfe::prelude::*;

#[dynamics(
    coordinates(sin),
    lagrangian = m/2*dot(sin)^2 - k/2*sin^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
