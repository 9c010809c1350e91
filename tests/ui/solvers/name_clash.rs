//! Two solvers of one name.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    solver(Fast, Mixed::<4>),
    solver(Fast, Mixed::<2>),
)]
struct Model { m: f64, k: f64 }

fn main() {}
