//! A target without a value.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - k/2*(x - y)^2,
    model(Held, frozen(x)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
