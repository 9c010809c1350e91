//! Keywords of Rust that nothing can be called.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - cos(x),
    output(crate) = x,
    constraint(super) = x - y,
    solver(Self, Mixed::<4>),
    model(self, truncated(2)),
)]
struct Model { m: f64 }

fn main() {}
