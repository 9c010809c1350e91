//! An angle whose momentum is not conserved.

#[tfe::dynamics(
    coordinates(r, phi),
    lagrangian = (dot(r)^2 + r^2*dot(phi)^2)/2 + mu/r,
    force(phi) = -dot(phi),
    model(Radial, routh(phi)),
)]
struct Planet {
    mu: f64,
}

fn main() {
    let planet = Planet { mu: 1.0 };
    let _ = Radial::of_state(&planet, &planet.state([1.0, 0.0], [0.0, 1.0]));
}
