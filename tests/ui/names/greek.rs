//! Greek letters keep their place.

#![allow(mixed_script_confusables)]

use tfe::prelude::*;

#[dynamics(
    coordinates(θ),
    lagrangian = m/2*dot(θ)^2 + k*cos(φ),
)]
struct Model { m: f64, k: f64 }

fn main() {}
