//! The time, its momentum and the methods of their states have names already.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, t),
    momenta(p_x, p_t),
    hamiltonian = (p_x^2 + p_t^2)/2,
    time_transformation = 1 + x^2,
    output(state_at) = x,
)]
struct Free;

fn main() {}
