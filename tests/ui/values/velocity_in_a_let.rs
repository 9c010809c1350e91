//! A velocity that comes in through a `let`.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    momenta(p),
    let speed = dot(x),
    hamiltonian = p^2/(2*m) + k/2*x^2 + speed,
)]
struct Model { m: f64, k: f64 }

fn main() {}
