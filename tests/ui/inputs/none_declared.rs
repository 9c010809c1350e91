//! A model without inputs cannot be given one.

use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2)]
struct Mass;

fn main() {
    let _ = Simulation::new(&Mass).step(0.1).input("u", f64::sin);
}
