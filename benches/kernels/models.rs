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

/// Two point masses on rods, declared by their positions.
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

/// The same, declared by the Lagrangian of the textbooks.
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

/// Three point masses on rods, declared by their positions.
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

/// The Hénon–Heiles system.
#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + lambda*(x^2*y - y^3/3),
)]
pub struct HenonHeiles {
    pub lambda: f64,
}

/// A heavy symmetric top with a fixed point: moments of inertia `a`, `a`, `c`, Euler angles.
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

/// A free rigid body with three different moments of inertia, Euler angles.
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

/// A spherical pendulum on a cart that moves on a straight track; its angles are that from the vertical and the azimuth
/// from the track.
#[dynamics(
    coordinates(x, theta, phi),
    let r = [x + l*sin(theta)*cos(phi), l*sin(theta)*sin(phi), -l*cos(theta)],
    lagrangian = mc/2*dot(x)^2 + m/2*inner(dot(r), dot(r)) - m*g*r[2],
)]
pub struct SphericalPendulumOnCart {
    pub mc: f64,
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

/// Foucault's pendulum with arbitrary amplitude, by its position over the ground: x north, y west, z up, on a planet
/// that rotates at `omega`.
#[dynamics(
    coordinates(x, y),
    let z = -sqrt(l^2 - x^2 - y^2),
    let spin = [omega*cos(latitude), 0, omega*sin(latitude)],
    let v = [dot(x), dot(y), dot(z)] + cross(spin, [x, y, z]),
    lagrangian = m/2*inner(v, v) - m*g*z,
)]
pub struct Foucault {
    pub m: f64,
    pub l: f64,
    pub g: f64,
    pub omega: f64,
    pub latitude: f64,
}

/// A satellite on a circular orbit with angular velocity `n`, under the gravity-gradient torque: a quaternion from body
/// to space, scalar first, and three moments of inertia. `up` is the local vertical in the body; the constraint |e| = 1
/// does not enter the kernels.
#[dynamics(
    coordinates(e[4]),
    let w = body_rate(e),
    let up = rotate([e[0], -e[1], -e[2], -e[3]], [cos(n*t), sin(n*t), 0]),
    lagrangian = (a*w[0]^2 + b*w[1]^2 + c*w[2]^2)/2 - 3*n^2/2*(a*up[0]^2 + b*up[1]^2 + c*up[2]^2),
)]
pub struct Satellite {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub n: f64,
}

/// A spatial robot arm: a column that turns about z, and an upper arm and a forearm that turn about parallel horizontal
/// axes, by the joint angles. Each link has its centre of mass at the distance `s` from the joint, and moments of
/// inertia `i` about its length and `j` across it.
#[dynamics(
    coordinates(a, b, c),
    let d = b + c,
    let upper = [cos(b)*cos(a), cos(b)*sin(a), sin(b)],
    let fore = [cos(d)*cos(a), cos(d)*sin(a), sin(d)],
    let r2 = s2*upper,
    let r3 = l2*upper + s3*fore,
    let w2 = [dot(a)*sin(b), dot(b), dot(a)*cos(b)],
    let w3 = [dot(a)*sin(d), dot(d), dot(a)*cos(d)],
    lagrangian = j1/2*dot(a)^2
        + m2/2*inner(dot(r2), dot(r2)) + (i2*w2[0]^2 + j2*(w2[1]^2 + w2[2]^2))/2
        + m3/2*inner(dot(r3), dot(r3)) + (i3*w3[0]^2 + j3*(w3[1]^2 + w3[2]^2))/2
        - g*(m2*r2[2] + m3*r3[2]),
)]
pub struct SpatialArm {
    pub j1: f64,
    pub m2: f64,
    pub l2: f64,
    pub s2: f64,
    pub i2: f64,
    pub j2: f64,
    pub m3: f64,
    pub s3: f64,
    pub i3: f64,
    pub j3: f64,
    pub g: f64,
}

/// A planar arm of two links in a vertical plane with elastic joints: angles of the links, the second relative to the
/// first, and of the motors behind the gears. Each link has its centre of mass at the distance `s` from the joint and a
/// moment of inertia `i` about it, each motor a moment `j`.
#[dynamics(
    coordinates(a, b, c, d),
    let x1 = s1*cos(a),
    let y1 = s1*sin(a),
    let x2 = l1*cos(a) + s2*cos(a + b),
    let y2 = l1*sin(a) + s2*sin(a + b),
    lagrangian = m1/2*(dot(x1)^2 + dot(y1)^2) + i1/2*dot(a)^2
        + m2/2*(dot(x2)^2 + dot(y2)^2) + i2/2*(dot(a) + dot(b))^2
        + j1/2*dot(c)^2 + j2/2*dot(d)^2 - k1/2*(a - c)^2 - k2/2*(b - d)^2 - g*(m1*y1 + m2*y2),
)]
pub struct ElasticArm {
    pub m1: f64,
    pub l1: f64,
    pub s1: f64,
    pub i1: f64,
    pub m2: f64,
    pub s2: f64,
    pub i2: f64,
    pub j1: f64,
    pub j2: f64,
    pub k1: f64,
    pub k2: f64,
    pub g: f64,
}

/// A bead on an elliptic wire that turns about its vertical axis at `omega`.
#[dynamics(
    coordinates(s),
    let r = a*sin(s),
    let z = -b*cos(s),
    lagrangian = m/2*(dot(r)^2 + dot(z)^2 + (omega*r)^2) - m*g*z,
)]
pub struct SpinningEllipse {
    pub m: f64,
    pub a: f64,
    pub b: f64,
    pub omega: f64,
    pub g: f64,
}
