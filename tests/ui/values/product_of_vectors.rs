//! A product of vectors is ambiguous.

use tfe::prelude::*;

#[dynamics(
    coordinates(r[3]),
    lagrangian = m/2*dot(r)*dot(r) - k*r[0],
)]
struct Model { m: f64, k: f64 }

fn main() {}
