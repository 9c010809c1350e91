//! A constraint on velocities as a spring.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y, phi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(phi)^2,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi),
    model(Soft, elastic(blade = k)),
)]
struct Model { m: f64, j: f64 }

fn main() {}
