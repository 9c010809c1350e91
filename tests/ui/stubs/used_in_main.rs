//! A model with a mistake is used in every way there is: only the mistake is reported.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - kk/2*(x^2 + y^2),
    output(radius) = hypot(x, y),
    solver(Fast, Mixed::<4>),
)]
#[derive(Clone, Debug)]
struct Model { m: f64, k: f64 }

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = Model { m: 1.0, k: 1.0 };
    let mut state = model.state([1.0, 0.0], [0.0, 1.0]);
    let simulation = Simulation::new(&model).element(Mixed::<4>).step(0.1);
    let motion = simulation.run(state, 0.0..10.0)?;
    println!("{} {:?}", motion.energy_error(), motion.outputs().column("radius"));
    println!("{}", model.radius(0.0, state.q, [0.0, 1.0]));
    println!("{}", Model::structure().page);
    let mut solver = Fast::new(&model, 0.1);
    solver.set_time(1.0);
    solver.advance(&mut state)?;
    println!("{} {} {solver:?} {:?}", Fast::BYTES, solver.time(), solver.statistics());
    Ok(())
}
