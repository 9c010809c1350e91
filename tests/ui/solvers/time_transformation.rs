//! The momentum of the time has no velocity, which these elements ask for.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    momenta(p),
    hamiltonian = p^2/2 + x^4,
    time_transformation = 1/(1 + x^2),
    solver(Displacements, Primal::<4>),
    solver(Velocities, ThreeField::<4>),
    solver(Fine, Mixed::<4>),
)]
struct Quartic;

fn main() {}
