//! The prefix of generated names.

use tfe::prelude::*;

#[dynamics(
    coordinates(__tfe_x),
    lagrangian = m/2*dot(__tfe_x)^2 - k/2*__tfe_x^2,
)]
struct Model { m: f64, k: f64 }

fn main() {}
