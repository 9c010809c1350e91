//! A solver keeps a copy of the model.

use tfe::prelude::*;

struct Log;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - k/2*x^2,
    solver(Fast, Mixed::<9>),
)]
struct Model {
    m: f64,
    k: f64,
    _log: Log,
}

fn main() {
    let model = Model { m: 1.0, k: 1.0, _log: Log };
    let mut state = model.state([1.0], [0.0]);
    println!("{:?}", Fast::new(&model, 0.1).advance(&mut state));
}
