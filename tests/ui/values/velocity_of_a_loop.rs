//! The velocities of a long Hamiltonian are not written out.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[N]),
    momenta(p[N]),
    hamiltonian = sum(i in 0..N, p[i]^2/(2*m) + k/2*q[i]^2),
    output(speed) = dot(q[0]),
)]
struct Model<const N: usize> { m: f64, k: f64 }

fn main() {}
