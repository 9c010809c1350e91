//! Three mistakes in one attribute give three messages.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(y)^2 - kk/2*x^2,
    force(x) = sine(t),
)]
struct Model { m: f64, k: f64 }

fn main() {}
