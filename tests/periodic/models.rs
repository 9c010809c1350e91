//! The models of these tests.

use std::f64::consts::TAU;
use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = m*(dot(x)^2 - x^2)/2, force(x) = m*mu*(1 - x^2)*dot(x), sensitivity(mu))]
#[derive(Clone)]
pub struct VanDerPol {
    pub m: f64,
    pub mu: f64,
}

impl VanDerPol {
    /// With a mass of one.
    pub const fn unit(mu: f64) -> Self {
        Self { m: 1.0, mu }
    }
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - alpha/2*x^2 - beta/4*x^4,
           force(x) = f*cos(omega*t) - delta*dot(x), sensitivity(omega, f))]
#[derive(Clone)]
pub struct Duffing {
    pub alpha: f64,
    pub beta: f64,
    pub delta: f64,
    pub f: f64,
    pub omega: f64,
}

/// The oscillator of `tests/reference/periodic.json`, with its response to the force as guess.
pub const FORCED: Duffing = Duffing {
    alpha: 1.0,
    beta: 1.0,
    delta: 0.2,
    f: 0.3,
    omega: 1.4,
};

pub fn response(t: f64) -> ([f64; 1], [f64; 1]) {
    ([-0.3 * (1.4 * t).cos()], [0.42 * (1.4 * t).sin()])
}

/// A rigid flapping blade in forward flight; the azimuth angle is the time.
#[dynamics(
    coordinates(b),
    let aero = lock/8,
    lagrangian = dot(b)^2/2,
    force(b) = -aero*(1 + 4/3*mu*sin(t))*dot(b) - (nu2 + aero*(4/3*mu*cos(t) + mu^2*sin(2*t)))*b
        + aero*(th0*(1 + 8/3*mu*sin(t) + 2*mu^2*sin(t)^2) - lam*(4/3 + 2*mu*sin(t))),
)]
pub struct Blade {
    pub lock: f64,
    pub nu2: f64,
    pub mu: f64,
    pub th0: f64,
    pub lam: f64,
}

#[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - (a - 2*q*cos(2*t))/2*y^2)]
pub struct Mathieu {
    pub a: f64,
    pub q: f64,
}

/// A shaft with unequal stiffnesses that rotates at Ω, in the fixed frame.
#[dynamics(
    coordinates(x, y),
    let k0 = (w1^2 + w2^2)/2,
    let dk = (w1^2 - w2^2)/2,
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - k0/2*(x^2 + y^2)
        - dk/2*(cos(2*omega*t)*(x^2 - y^2) + 2*sin(2*omega*t)*x*y),
)]
pub struct Shaft {
    pub w1: f64,
    pub w2: f64,
    pub omega: f64,
}

/// A saddle and a damped oscillator, mixed by a frame that rotates once in the period 2π.
///
/// In the rotating frame with the coordinates ξ and η, ξ̈ = a² ξ and η̈ = −2c η̇ − (c² + w²) η; in the fixed one x = ξ
/// cos t − η sin t.
#[dynamics(
    coordinates(x, y),
    let xi = cos(t)*x + sin(t)*y,
    let eta = -sin(t)*x + cos(t)*y,
    let dxi = dot(xi),
    let deta = dot(eta),
    lagrangian = (dxi^2 + deta^2)/2 + a^2/2*xi^2 - (c^2 + w^2)/2*eta^2,
    force(x) = 2*c*deta*sin(t),
    force(y) = -2*c*deta*cos(t),
)]
pub struct TurningSaddle {
    pub a: f64,
    pub c: f64,
    pub w: f64,
}

/// The plane pendulum.
#[dynamics(coordinates(theta), lagrangian = m*dot(theta)^2/2 + k*cos(theta), sensitivity(k))]
#[derive(Clone)]
pub struct Pendulum {
    pub m: f64,
    pub k: f64,
}

pub const PENDULUM: Pendulum = Pendulum { m: 1.0, k: 1.0 };

/// The arithmetic–geometric mean.
pub fn agm(mut a: f64, mut b: f64) -> f64 {
    for _ in 0..10 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// The period 2π √(m/k) / M(1, cos A/2) of a pendulum with the energy H = p²/2m − k cos θ, where M is the
/// arithmetic–geometric mean and k cos A = −H.
pub fn pendulum_period([m, k]: [f64; 2], energy: f64) -> f64 {
    TAU * (m / k).sqrt() / agm(1.0, (0.5 * (1.0 - energy / k)).sqrt())
}

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y)]
pub struct Projectile {
    pub g: f64,
}

#[dynamics(coordinates(x, y), momenta(px, py),
           hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + a*(x^2*y - y^3/3), sensitivity(a))]
#[derive(Clone)]
pub struct HenonHeiles {
    pub a: f64,
}
