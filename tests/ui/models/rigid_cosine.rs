//! A potential that is no spring.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 + k*cos(x),
    model(Held, rigid(wall = k)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
