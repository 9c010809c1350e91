//! A Lagrangian or a Hamiltonian, not both.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    hamiltonian = x^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
