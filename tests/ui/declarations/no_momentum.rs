//! A momentum that the Hamiltonian does not know.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = px^2/(2*m) + k/2*(x^2 + y^2),
)]
struct Model { m: f64, k: f64 }

fn main() {}
