//! A misspelt element.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    solver(Fast, Mixd::<4>),
)]
struct Model { m: f64, k: f64 }

fn main() {}
