//! A Hamiltonian has momenta.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    momenta(p),
    hamiltonian = m/2*dot(x)^2 + k/2*x^2 + p^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
