//! p_t = −H needs an H. One message, though the model is used.

use tfe::prelude::*;

#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2),
    time_transformation = sqrt(x^2 + y^2),
    output(time) = t,
)]
struct Kepler;

fn main() {
    let state: State<3> = Kepler.state_at(1.0, [1.0, 0.0], [0.0, 1.0]);
    println!("{:?}", Simulation::new(&Kepler).run(state, 0.0..1.0).is_ok());
    println!("{}", Kepler.time(0.0, [0.0; 3], [0.0; 3]));
}
