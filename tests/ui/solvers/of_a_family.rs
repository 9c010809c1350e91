//! Solvers need a literal size.

use tfe::prelude::*;

#[dynamics(
    coordinates(q[N]),
    lagrangian = sum(i in 0..N, m/2*dot(q[i])^2 - k/2*q[i]^2),
    solver(Fast, Mixed::<4>),
)]
struct Model<const N: usize> { m: f64, k: f64 }

fn main() {
    let model = Model::<3> { m: 1.0, k: 1.0 };
    let mut state = model.state([1.0; 3], [0.0; 3]);
    println!("{:?}", Fast::new(&model, 0.1).advance(&mut state));
}
