//! The models, declared as a user would declare them.

use tfe::prelude::*;

/// A pendulum.
#[dynamics(
    coordinates(theta),
    lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta),
)]
pub struct Pendulum {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

/// Two point masses, declared by where they are.
#[dynamics(
    coordinates(a, b),
    let x1 = l1*sin(a),
    let y1 = -l1*cos(a),
    let x2 = x1 + l2*sin(b),
    let y2 = y1 - l2*cos(b),
    lagrangian = m1/2*(dot(x1)^2 + dot(y1)^2) + m2/2*(dot(x2)^2 + dot(y2)^2) - g*(m1*y1 + m2*y2),
)]
pub struct DoublePendulum {
    pub m1: f64,
    pub m2: f64,
    pub l1: f64,
    pub l2: f64,
    pub g: f64,
}

/// The same, declared by the formula of the textbooks.
#[dynamics(
    coordinates(a, b),
    lagrangian = (m1 + m2)*l1^2/2*dot(a)^2 + m2*l2^2/2*dot(b)^2 + m2*l1*l2*dot(a)*dot(b)*cos(a - b)
        + (m1 + m2)*g*l1*cos(a) + m2*g*l2*cos(b),
)]
pub struct DoublePendulumAngles {
    pub m1: f64,
    pub m2: f64,
    pub l1: f64,
    pub l2: f64,
    pub g: f64,
}

/// Three point masses, declared by where they are.
#[dynamics(
    coordinates(a, b, c),
    let x1 = l1*sin(a),
    let y1 = -l1*cos(a),
    let x2 = x1 + l2*sin(b),
    let y2 = y1 - l2*cos(b),
    let x3 = x2 + l3*sin(c),
    let y3 = y2 - l3*cos(c),
    lagrangian = m1/2*(dot(x1)^2 + dot(y1)^2) + m2/2*(dot(x2)^2 + dot(y2)^2) + m3/2*(dot(x3)^2 + dot(y3)^2)
        - g*(m1*y1 + m2*y2 + m3*y3),
)]
pub struct TriplePendulum {
    pub m1: f64,
    pub m2: f64,
    pub m3: f64,
    pub l1: f64,
    pub l2: f64,
    pub l3: f64,
    pub g: f64,
}

/// The same, declared by angles.
#[dynamics(
    coordinates(a, b, c),
    let m23 = m2 + m3,
    let m123 = m1 + m23,
    lagrangian = m123*l1^2/2*dot(a)^2 + m23*l2^2/2*dot(b)^2 + m3*l3^2/2*dot(c)^2
        + m23*l1*l2*dot(a)*dot(b)*cos(a - b) + m3*l1*l3*dot(a)*dot(c)*cos(a - c) + m3*l2*l3*dot(b)*dot(c)*cos(b - c)
        + g*(m123*l1*cos(a) + m23*l2*cos(b) + m3*l3*cos(c)),
)]
pub struct TriplePendulumAngles {
    pub m1: f64,
    pub m2: f64,
    pub m3: f64,
    pub l1: f64,
    pub l2: f64,
    pub l3: f64,
    pub g: f64,
}

/// A star in a galaxy.
#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + lambda*(x^2*y - y^3/3),
)]
pub struct HenonHeiles {
    pub lambda: f64,
}

/// A heavy symmetric top about a fixed point: moments `a`, `a`, `c`, Euler's angles.
#[dynamics(
    coordinates(phi, theta, psi),
    lagrangian = a/2*(dot(theta)^2 + (dot(phi)*sin(theta))^2) + c/2*(dot(psi) + dot(phi)*cos(theta))^2 - m*g*l*cos(theta),
)]
pub struct HeavyTop {
    pub a: f64,
    pub c: f64,
    pub m: f64,
    pub g: f64,
    pub l: f64,
}

/// A free body, three different moments, Euler's angles.
#[dynamics(
    coordinates(phi, theta, psi),
    let o1 = dot(phi)*sin(theta)*sin(psi) + dot(theta)*cos(psi),
    let o2 = dot(phi)*sin(theta)*cos(psi) - dot(theta)*sin(psi),
    let o3 = dot(phi)*cos(theta) + dot(psi),
    lagrangian = (a*o1^2 + b*o2^2 + c*o3^2)/2,
)]
pub struct FreeBody {
    pub a: f64,
    pub b: f64,
    pub c: f64,
}

/// Six bodies that attract each other.
#[dynamics(
    coordinates(x[6], y[6], z[6]),
    lagrangian = sum(i in 0..6, m[i]/2*(dot(x[i])^2 + dot(y[i])^2 + dot(z[i])^2))
        + sum(i in 1..6, sum(j in 0..i, g*m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2 + (z[i] - z[j])^2))),
)]
pub struct Planets {
    pub g: f64,
    pub m: [f64; 6],
}

/// Fermi, Pasta, Ulam, Tsingou: 32 masses in a row between walls, springs of V(δ) = δ²/2 + a δ³/3.
#[dynamics(
    coordinates(q[32]),
    momenta(p[32]),
    hamiltonian = sum(i in 0..32, p[i]^2/2)
        + q[0]^2/2 + a/3*q[0]^3 + sum(i in 0..31, (q[i+1] - q[i])^2/2 + a/3*(q[i+1] - q[i])^3) + q[31]^2/2 - a/3*q[31]^3,
)]
pub struct Fput {
    pub a: f64,
}
