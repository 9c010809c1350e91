//! The rate of a momentum is what the equations give.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    momenta(p),
    hamiltonian = p^2/(2*m) + k/2*x^2,
    output(push) = dot(p),
)]
struct Model { m: f64, k: f64 }

fn main() {}
