//! So do solvers, and derivatives by parameters.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2),
    solver(Fast, Mixed::<4>),
    sensitivity(m),
)]
struct Chain { n: usize, m: f64 }

fn main() {}
