//! Two models on one struct.

use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/2*x^2)]
#[dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - k/4*x^4)]
struct Model { m: f64, k: f64 }

fn main() {
    println!("{:?}", Model { m: 1.0, k: 1.0 }.state([1.0], [0.0]));
}
