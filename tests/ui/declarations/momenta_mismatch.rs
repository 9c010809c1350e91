//! One momentum a coordinate.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    momenta(p),
    hamiltonian = p^2/(2*m) + k*(x^2 + y^2),
)]
struct Model { m: f64, k: f64 }

fn main() {}
