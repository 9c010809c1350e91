//! The time comes by itself.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - (k[0] + k[1])/2*x^2,
    force(x) = cos(omega*t),
    sensitivity(omega, t),
)]
struct Model { m: f64, k: [f64; 2], omega: f64 }

fn main() {}
