//! A model is a struct.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2,
)]
enum Model { A }

fn main() {}
