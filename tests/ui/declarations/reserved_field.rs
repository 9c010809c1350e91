//! A field that shadows the time.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2*t,
)]
struct Model { m: f64, k: f64, t: f64 }

fn main() {}
