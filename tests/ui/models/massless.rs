//! A truncation that leaves no kinetic energy.

use tfe::prelude::*;

#[dynamics(
    coordinates(r, phi),
    lagrangian = m/2*(dot(r)^2 + r^2*dot(phi)^2) - k/2*r^2,
    model(Near, truncated(2)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
