//! A rule has points.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    solver(Fast, Mixed::<4>.quadrature(0)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
