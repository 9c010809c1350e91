//! A state with the time in it needs a length known to the macro.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2 + q[i]^2/2),
    time_transformation = 1 + q[0]^2,
)]
struct Row { n: usize }

#[dynamics(
    coordinates(q[N]),
    momenta(p[N]),
    hamiltonian = sum(i in 0..N, p[i]^2/2 + q[i]^2/2),
    time_transformation = 1 + q[0]^2,
)]
struct Generic<const N: usize>;

fn main() {}
