//! The time goes forward.

use tfe::prelude::*;

#[dynamics(coordinates(x), momenta(p), hamiltonian = p^2/2 + x^2/2, time_transformation = -1)]
struct Oscillator;

fn main() {}
