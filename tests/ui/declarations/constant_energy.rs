//! A constant has no motion.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m*k,
)]
struct Model { m: f64, k: f64 }

fn main() {}
