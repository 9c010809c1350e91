//! A closed chain of three bodies and four revolute joints in space: of four-bar linkages in a plane, and of Bennett's.

use tfe::prelude::*;

/// Three bars between the origin and a point of the ground, by the places of their middles and by unit quaternions. The
/// axes of a bar's joints are perpendicular to it; that at its end is twisted about it by alpha, by beta for the second
/// bar. Ball joints at four points, and three further conditions at each of them that make it a hinge: 27 equations, of
/// which 20 are independent, for 21 coordinates and one degree of freedom.
#[dynamics(
    coordinates(r1[3], e1[4], r2[3], e2[4], r3[3], e3[4]),
    let w1 = body_rate(e1),
    let w2 = body_rate(e2),
    let w3 = body_rate(e3),
    let h1 = rotate(e1, [l1/2, 0, 0]),
    let h2 = rotate(e2, [l2/2, 0, 0]),
    let h3 = rotate(e3, [l3/2, 0, 0]),
    lagrangian = m1/2*inner(dot(r1), dot(r1)) + m2/2*inner(dot(r2), dot(r2)) + m3/2*inner(dot(r3), dot(r3))
        + m1*l1^2/24*(w1[0]^2/50 + w1[1]^2 + w1[2]^2) + m2*l2^2/24*(w2[0]^2/50 + w2[1]^2 + w2[2]^2)
        + m3*l3^2/24*(w3[0]^2/50 + w3[1]^2 + w3[2]^2) - g*(m1*r1[1] + m2*r2[1] + m3*r3[1]),
    constraint(unit1) = inner(e1, e1) - 1,
    constraint(unit2) = inner(e2, e2) - 1,
    constraint(unit3) = inner(e3, e3) - 1,
    constraint(at_a) = r1 - h1,
    constraint(at_b) = r1 + h1 - r2 + h2,
    constraint(at_c) = r2 + h2 - r3 + h3,
    constraint(at_d) = r3 + h3 - [ground, 0, 0],
    constraint(axis_a) = rotate(e1, [0, 0, 1]) - [0, 0, 1],
    constraint(axis_b) = rotate(e1, [0, -sin(alpha), cos(alpha)]) - rotate(e2, [0, 0, 1]),
    constraint(axis_c) = rotate(e2, [0, -sin(beta), cos(beta)]) - rotate(e3, [0, 0, 1]),
    constraint(axis_d) = rotate(e3, [0, -sin(alpha), cos(alpha)]) - [0, sin(beta), cos(beta)],
)]
pub struct SpatialFourBar {
    pub l1: f64,
    pub l2: f64,
    pub l3: f64,
    pub ground: f64,
    pub alpha: f64,
    pub beta: f64,
    pub m1: f64,
    pub m2: f64,
    pub m3: f64,
    pub g: f64,
}
