//! Constraints are written in velocities.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2)/(2*m) + m*g*y,
    constraint(slide) = px - y*py,
)]
struct Model { m: f64, g: f64 }

fn main() {}
