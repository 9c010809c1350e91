//! Neither constraints nor sensitivities go with a time of the steps' own.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + g*y,
    constraint(rod) = x^2 + y^2 - 1,
    sensitivity(g),
    time_transformation = 1 + x^2,
)]
struct Pendulum { g: f64 }

fn main() {}
