//! A `let` used too early.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    let a = b + x,
    let b = k,
    lagrangian = m/2*dot(x)^2 - a^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
