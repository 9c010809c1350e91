//! A type that cannot hold parameters still has the methods of a model.

use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2)]
struct Model(f64);

fn main() {
    let model = Model(1.0);
    let state = model.state([1.0], [0.0]);
    println!("{:?}", Simulation::new(&model).run(state, 0.0..1.0).is_ok());
}
