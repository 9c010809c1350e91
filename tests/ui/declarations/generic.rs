//! Lifetimes and types are no parameters of a model.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
)]
struct Model<'a, T> { m: f64, k: f64, x: T, name: &'a str }

fn main() {}
