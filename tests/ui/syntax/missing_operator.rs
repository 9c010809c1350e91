//! Two factors without an operator.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k x^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
