//! The models of these tests.

use tfe::prelude::*;

#[dynamics(coordinates(theta), lagrangian = dot(theta)^2/2 + k*cos(theta))]
pub struct Pendulum {
    pub k: f64,
}

#[dynamics(coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2)/2 - 1/sqrt(x^2 + y^2))]
pub struct Kepler {}

#[dynamics(coordinates(x, y), momenta(px, py),
           hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + lambda*(x^2*y - y^3/3))]
pub struct HenonHeiles {
    pub lambda: f64,
}

#[dynamics(
    coordinates(theta1, theta2),
    let x1 = l1 * sin(theta1),
    let y1 = -l1 * cos(theta1),
    let x2 = x1 + l2 * sin(theta2),
    let y2 = y1 - l2 * cos(theta2),
    lagrangian = m1/2 * (dot(x1)^2 + dot(y1)^2) + m2/2 * (dot(x2)^2 + dot(y2)^2) - g * (m1*y1 + m2*y2),
    output(tip_x) = x2,
    output(tip_y) = y2,
)]
#[derive(Clone, Copy)]
pub struct DoublePendulum {
    pub m1: f64,
    pub m2: f64,
    pub l1: f64,
    pub l2: f64,
    pub g: f64,
}

impl DoublePendulum {
    pub const UNIT: Self = Self {
        m1: 1.0,
        m2: 1.0,
        l1: 1.0,
        l2: 1.0,
        g: 9.81,
    };
}

/// A rigid body about a fixed point as an unconstrained Hamiltonian system in the quaternion and its momenta: the body
/// angular momenta are πᵢ = ½ p · (e ∘ uᵢ), H = Σ πᵢ²/(2 Iᵢ) + mgd (e₀² − e₁² − e₂² + e₃²). |e| is conserved.
#[dynamics(
    coordinates(e[4]), momenta(p[4]),
    let pi1 = (-p[0]*e[1] + p[1]*e[0] + p[2]*e[3] - p[3]*e[2])/2,
    let pi2 = (-p[0]*e[2] - p[1]*e[3] + p[2]*e[0] + p[3]*e[1])/2,
    let pi3 = (-p[0]*e[3] + p[1]*e[2] - p[2]*e[1] + p[3]*e[0])/2,
    hamiltonian = pi1^2/(2*i1) + pi2^2/(2*i2) + pi3^2/(2*i3) + mgd*(e[0]^2 - e[1]^2 - e[2]^2 + e[3]^2),
    output(w1) = pi1/i1,
    output(w2) = pi2/i2,
    output(w3) = pi3/i3,
)]
pub struct RigidBody {
    pub i1: f64,
    pub i2: f64,
    pub i3: f64,
    pub mgd: f64,
}

impl RigidBody {
    /// The state with the attitude `e` and body rates `w`: p = 2 e ∘ (0, I w).
    pub fn moving(&self, e: [f64; 4], w: [f64; 3]) -> State<4> {
        let [a, b, c] = [self.i1 * w[0], self.i2 * w[1], self.i3 * w[2]];
        let p = [
            -e[1] * a - e[2] * b - e[3] * c,
            e[0] * a + e[2] * c - e[3] * b,
            e[0] * b + e[3] * a - e[1] * c,
            e[0] * c + e[1] * b - e[2] * a,
        ];
        State {
            q: e,
            p: p.map(|p| 2.0 * p),
        }
    }
}

/// The heavy symmetric top in 3-1-3 Euler angles.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = jt/2*(dot(theta)^2 + (dot(phi)*sin(theta))^2) + ja/2*(dot(psi) + dot(phi)*cos(theta))^2 - mgd*cos(theta),
)]
pub struct EulerTop {
    pub jt: f64,
    pub ja: f64,
    pub mgd: f64,
}

/// Nonlinear, time-dependent and damped, as a general case for equivalences.
#[dynamics(
    coordinates(x, y),
    lagrangian = (1 + x^2/4)*dot(x)^2/2 + dot(y)^2/2 + x*dot(y)*y/3 - x^4/4 - cos(y)*(1 + sin(t)/5) - x*y/3,
    force(x) = -c*dot(x)*(1 + y^2) + cos(2*t)/4,
    dissipation = c/3*dot(y)^2,
)]
pub struct Everything {
    pub c: f64,
}
