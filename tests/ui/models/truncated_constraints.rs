//! A truncation beside constraints.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - k/2*(x - y)^2,
    constraint(rod) = x*y - 1,
    model(Near, truncated(2)),
)]
struct Model { m: f64, k: f64 }

fn main() {}
