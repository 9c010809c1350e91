//! Velocity constraints need one point less than nodes.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(blade) = dot(x)*sin(y) - dot(y),
    solver(Fast, Primal::<4>.lobatto()),
)]
struct Model { m: f64, g: f64 }

fn main() {}
