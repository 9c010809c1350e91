//! An energy is a number.

use tfe::prelude::*;

#[dynamics(
    coordinates(r[3]),
    lagrangian = (m + k)*dot(r),
)]
struct Model { m: f64, k: f64 }

fn main() {}
