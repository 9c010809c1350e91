//! A mistake elsewhere: fields of the models made from this one are no further mistakes.

use tfe::prelude::*;

#[dynamics(
    coordinates(r, phi),
    lagrangian = (dot(r)^2 + r^2*dot(phi)^2)/2 + mu/s,
    model(Radial, routh(phi)),
)]
struct Planet {
    mu: f64,
}

fn main() {
    let planet = Planet { mu: 1.0 };
    let (radial, _) = Radial::of_state(&planet, &planet.state([1.0, 0.0], [0.0, 1.0]));
    println!("{} {}", radial.mu, Radial::of(&planet, radial.p_phi).p_phi);
}
