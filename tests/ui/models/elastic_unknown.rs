//! A constraint that is misspelt.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2),
    constraint(rod) = x^2 + y^2 - l^2,
    model(Soft, elastic(rood = k)),
)]
struct Model { m: f64, l: f64 }

fn main() {}
