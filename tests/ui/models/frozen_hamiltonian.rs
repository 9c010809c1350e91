//! A frozen coordinate of a Hamiltonian.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    momenta(p, q),
    hamiltonian = (p^2 + q^2)/(2*m) + k/2*(x - y)^2,
    model(Held, frozen(x = 0)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
