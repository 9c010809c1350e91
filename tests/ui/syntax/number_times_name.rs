//! `2x` is one token of Rust.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m*dot(x)^2/2 - 2x*k,
)]
struct Model { m: f64, k: f64 }

fn main() {}
