//! The models of the recorded cases.

use tfe::prelude::*;

#[dynamics(coordinates(theta), lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta))]
pub struct Pendulum {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

#[dynamics(
    coordinates(a, b),
    let x = l1*sin(a) + l2*sin(b),
    let y = -l1*cos(a) - l2*cos(b),
    lagrangian = m1/2*l1^2*dot(a)^2 + m2/2*(dot(x)^2 + dot(y)^2) + m1*g*l1*cos(a) - m2*g*y,
    force(a) = -c*dot(a),
    event(bottom) = b,
    solver(EmittedDouble, Mixed::<4>),
)]
pub struct DoublePendulum {
    pub m1: f64,
    pub m2: f64,
    pub l1: f64,
    pub l2: f64,
    pub g: f64,
    pub c: f64,
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2*y - y^3/3,
    solver(EmittedGalaxy, Mixed::<5>),
)]
pub struct HenonHeiles;

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + 1/sqrt(x^2 + y^2))]
pub struct Kepler;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
pub struct VanDerPol {
    pub mu: f64,
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2 - b*x^4/4, force(x) = f*cos(w*t) - c*dot(x))]
pub struct Duffing {
    pub b: f64,
    pub c: f64,
    pub f: f64,
    pub w: f64,
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = px^2/(2*(1 + x^2)) + py^2/2*(1 + x^2) + x^4/4 + y^2/2 + a*px*y,
)]
pub struct Curved {
    pub a: f64,
}

#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + w*(x*dot(y) - y*dot(x)) - x^2 - 2*y^2)]
pub struct Gyroscopic {
    pub w: f64,
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
)]
pub struct Rod {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

#[dynamics(
    coordinates(x, y, phi),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 + j/2*dot(phi)^2 + g*x,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi),
)]
pub struct Blade {
    pub j: f64,
    pub g: f64,
}

#[dynamics(
    coordinates(e[4]),
    let w = body_rate(e),
    let up = rotate(e, [0, 0, 1]),
    lagrangian = (a*(w[0]^2 + w[1]^2) + c*w[2]^2)/2 - h*up[2],
    constraint(unit) = inner(e, e) - 1,
)]
pub struct Top {
    pub a: f64,
    pub c: f64,
    pub h: f64,
}

#[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - g*y - k/2*min(y, 0)^2, event(low) = y + 0.05)]
pub struct Landing {
    pub g: f64,
    pub k: f64,
}

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3),
)]
pub struct Chain {
    pub n: usize,
    pub m: f64,
    pub k: f64,
    pub a: f64,
}

#[cfg(feature = "sparse")]
#[dynamics(
    coordinates(x[n], y[n]),
    lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - g*y[i]),
    constraint(first) = x[0]^2 + y[0]^2 - 1,
    constraint(rod[i in 0..n-1]) = (x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 - 1,
)]
pub struct HangingChain {
    pub n: usize,
    pub g: f64,
}

pub const PENDULUM: Pendulum = Pendulum {
    m: 1.3,
    l: 0.7,
    g: 9.81,
};
pub const DOUBLE: DoublePendulum = DoublePendulum {
    m1: 1.0,
    m2: 0.8,
    l1: 1.0,
    l2: 0.6,
    g: 9.81,
    c: 0.05,
};
pub const DUFFING: Duffing = Duffing {
    b: 0.5,
    c: 0.1,
    f: 0.7,
    w: 1.2,
};
pub const ROD: Rod = Rod {
    m: 1.1,
    l: 1.0,
    g: 9.81,
};
pub const BLADE: Blade = Blade { j: 0.3, g: 2.0 };
pub const TOP: Top = Top {
    a: 1.0,
    c: 0.4,
    h: 1.7,
};
