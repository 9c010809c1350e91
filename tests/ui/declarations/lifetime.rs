//! A model owns its parameters.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - k*x^2,
)]
struct Model<'a> { k: &'a f64 }

fn main() {
    let model = Model { k: &1.0 };
    println!("{:?}", model.state([1.0], [0.0]));
}
