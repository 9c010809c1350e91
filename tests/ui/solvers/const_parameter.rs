//! A solver is for one type.

use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = m/2*dot(x)^2 - sum(i in 0..N, w[i]*x^2),
    solver(Fast, Mixed::<9>),
)]
struct Model<const N: usize> { m: f64, w: [f64; N] }

fn main() {
    let model = Model { m: 1.0, w: [1.0; 3] };
    let mut state = model.state([1.0], [0.0]);
    println!("{:?}", Fast::new(&model, 0.1).advance(&mut state));
}
