//! Nothing moves.

use tfe::prelude::*;

#[dynamics(
    lagrangian = m + k,
)]
struct Model { m: f64, k: f64 }

fn main() {}
