//! Parameters need names.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2,
)]
struct Model(f64);

fn main() {}
