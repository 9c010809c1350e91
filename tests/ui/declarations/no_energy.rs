//! Neither a Lagrangian nor a Hamiltonian.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
)]
struct Model {}

fn main() {}
