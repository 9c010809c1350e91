//! A wrong constraint gives one message, though the model is used.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - len^2,
    solver(Fast, Mixed::<3>),
)]
struct Model { m: f64, g: f64 }

fn main() {
    let model = Model { m: 1.0, g: 9.81 };
    let mut state = model.state([0.0, -1.0], [1.0, 0.0]);
    let mut fast = Fast::new(&model, 0.01);
    fast.advance(&mut state).ok();
    println!("{}", Model::structure());
}
