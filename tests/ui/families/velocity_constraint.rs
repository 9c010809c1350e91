//! Constraints of models of run-time length are conditions on positions.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2),
    constraint(together[i in 0..n-1]) = dot(q[i+1]) - dot(q[i]),
)]
struct Chain { n: usize, m: f64 }

fn main() {}
