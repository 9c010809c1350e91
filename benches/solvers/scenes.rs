//! The models, each with steppers of four and of nine nodes.

use tfe::prelude::*;

/// Unit length, mass and gravity.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + cos(theta),
    solver(Pendulum4, Mixed::<4>),
    solver(Pendulum9, Mixed::<9>),
)]
pub struct Pendulum {}

/// Two unit masses on two unit rods.
#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + g*(2*cos(a) + cos(b)),
    solver(DoublePendulum4, Mixed::<4>),
    solver(DoublePendulum9, Mixed::<9>),
)]
pub struct DoublePendulum {
    pub g: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2),
    solver(Kepler4, Mixed::<4>),
    solver(Kepler9, Mixed::<9>),
)]
pub struct Kepler {}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3,
    solver(HenonHeiles4, Mixed::<4>),
    solver(HenonHeiles9, Mixed::<9>),
)]
pub struct HenonHeiles {}

/// Bodies that attract each other.
#[dynamics(
    coordinates(x[6], y[6], z[6]),
    lagrangian = sum(i in 0..6, m[i]/2*(dot(x[i])^2 + dot(y[i])^2 + dot(z[i])^2))
        + sum(i in 1..6, sum(j in 0..i, g*m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2 + (z[i] - z[j])^2))),
    solver(Planets4, Mixed::<4>),
    solver(Planets9, Mixed::<9>),
)]
pub struct Planets {
    pub g: f64,
    pub m: [f64; 6],
}

/// Unit masses between walls, springs of force δ + α δ².
#[dynamics(
    coordinates(q[32]),
    lagrangian = sum(i in 0..32, dot(q[i])^2/2) - sum(i in 0..31, (q[i+1] - q[i])^2/2 + alpha/3*(q[i+1] - q[i])^3)
        - (q[0]^2/2 + alpha/3*q[0]^3) - (q[31]^2/2 - alpha/3*q[31]^3),
    solver(Fput4, Mixed::<4>),
    solver(Fput9, Mixed::<9>),
)]
pub struct Fput {
    pub alpha: f64,
}

#[dynamics(
    coordinates(x),
    lagrangian = dot(x)^2/2 - x^2/2,
    force(x) = mu*(1 - x^2)*dot(x),
    solver(VanDerPol4, Mixed::<4>),
    solver(VanDerPol9, Mixed::<9>),
)]
pub struct VanDerPol {
    pub mu: f64,
}

/// About a fixed point: moments `a`, `a`, `c`, weight times distance `w`, Euler's angles.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = a/2*(dot(theta)^2 + (dot(phi)*sin(theta))^2) + c/2*(dot(psi) + dot(phi)*cos(theta))^2 - w*cos(theta),
    solver(HeavyTop4, Mixed::<4>),
    solver(HeavyTop9, Mixed::<9>),
)]
pub struct HeavyTop {
    pub a: f64,
    pub c: f64,
    pub w: f64,
}
