//! A model that is called like a solver.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    solver(Fast, Mixed::<3>),
    model(Fast, truncated(2)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
