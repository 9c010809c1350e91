//! Beside a time transformation.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    momenta(p),
    hamiltonian = p^2/(2*m) + k/2*x^2,
    time_transformation = 1 + x^2,
    model(Near, truncated(2)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
