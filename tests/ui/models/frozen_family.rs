//! A frozen coordinate of a model of run-time length.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2 - k/2*q[i]^2),
    model(Held, frozen(q[0] = 0)),
)]
struct Model { n: usize, m: f64, k: f64 }

fn main() {}
