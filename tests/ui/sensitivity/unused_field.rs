//! Naming a field in the list is no use of it.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - x^2/2,
    sensitivity(c),
)]
struct Model { m: f64, c: f64 }

fn main() {}
