//! A rule that the element does not have.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    solver(Fast, Radau::<4>.reduced()),
)]
struct Model { m: f64, k: f64 }

fn main() {}
