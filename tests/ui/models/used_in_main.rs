//! A model made from a wrong one is used: one mistake, one message.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - kk/2*(x - y)^2,
    output(gap) = x - y,
    model(Held, frozen(x = 0)),
    model(Near, truncated(2)),
)]
struct Model { m: f64, k: f64 }

fn main() {
    let model = Model { m: 1.0, k: 2.0 };
    let held = Held::of(&model);
    let motion = Simulation::new(&held).element(Mixed::<3>).step(0.1).run(held.state([1.0], [0.0]), 0.0..1.0);
    let _ = (motion, Held::structure(), held.gap(0.0, [1.0], [0.0]));
    let near = Near::of(&model);
    let _ = near.state([1.0, 0.0], [0.0, 0.0]);
}
