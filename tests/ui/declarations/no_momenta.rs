//! A Hamiltonian needs momenta.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    hamiltonian = k/2*x^2 + m,
)]
struct Model { m: f64, k: f64 }

fn main() {}
