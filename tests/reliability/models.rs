//! The models that several files use.

use tfe::prelude::*;

/// A point mass on a rod, with a constraint in any unit.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(rod) = s*(x^2 + y^2 - l^2),
)]
pub struct Rod {
    pub g: f64,
    pub l: f64,
    pub s: f64,
}

/// A mass on a spring that falls through air.
#[dynamics(coordinates(y), lagrangian = m/2*dot(y)^2 - k/2*y^2 - m*g*y, force(y) = -m*c*dot(y))]
pub struct Damped {
    pub m: f64,
    pub k: f64,
    pub g: f64,
    pub c: f64,
}

/// Two masses on springs, coupled by their inertia: the mass matrix has the eigenvalues m − c and m + c.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + c*dot(x)*dot(y) - k/2*x^2 - l/2*y^2,
)]
pub struct Coupled {
    pub m: f64,
    pub c: f64,
    pub k: f64,
    pub l: f64,
}
