//! Lints that users may deny, and all visibilities.

#![deny(
    clippy::pedantic,
    missing_copy_implementations,
    missing_debug_implementations,
    unused_qualifications
)]

/// Visible everywhere.
#[tfe::dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - 1,
    output(height) = y,
    sensitivity(g),
    solver(Stepper, Mixed::<3>),
    model(Soft, elastic(rod = k)),
)]
#[derive(Clone, Copy, Debug)]
pub struct Pendulum {
    /// Mass.
    pub m: f64,
    /// Gravity.
    pub g: f64,
}

/// Visible in the crate.
#[tfe::dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - x^2/2, solver(CrateStepper, Mixed::<3>), model(CrateNear, truncated(2)))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct OfCrate {
    pub(crate) m: f64,
}

/// Visible in a path.
#[tfe::dynamics(coordinates(x), lagrangian = m/2*dot(x)^2 - x^2/2, solver(PathStepper, Mixed::<3>), model(PathNear, truncated(2)))]
#[derive(Clone, Copy, Debug)]
pub(in super::strict) struct OfPath {
    pub(in super::strict) m: f64,
}

/// The momentum that belongs to velocity one, for all models but the first.
pub(crate) fn momenta() -> [f64; 2] {
    let (own, path) = (OfCrate { m: 2.0 }, OfPath { m: 3.0 });
    let near = PathNear::of(&path);
    [own.state([0.0], [1.0]).p[0], near.state([0.0], [1.0]).p[0]]
}
