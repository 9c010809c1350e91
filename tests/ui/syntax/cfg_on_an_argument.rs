//! Arguments do not depend on the configuration.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - k/2*x^2,
    #[cfg(all())]
    output(pull) = k*x,
)]
struct Model { k: f64 }

fn main() {
    println!("{}", Model { k: 1.0 }.pull(0.0, [1.0], [0.0]));
}
