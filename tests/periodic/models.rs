//! The models of these tests.

use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
#[derive(Clone)]
pub struct VanDerPol {
    pub mu: f64,
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - alpha/2*x^2 - beta/4*x^4,
           force(x) = f*cos(omega*t) - delta*dot(x))]
#[derive(Clone)]
pub struct Duffing {
    pub alpha: f64,
    pub beta: f64,
    pub delta: f64,
    pub f: f64,
    pub omega: f64,
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

#[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + cos(theta))]
#[derive(Clone)]
pub struct Pendulum {}

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y)]
pub struct Projectile {
    pub g: f64,
}

#[dynamics(coordinates(x, y), momenta(px, py),
           hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2*y - y^3/3)]
pub struct HenonHeiles {}
