//! The scenes that several files use.

use tfe::prelude::*;

/// A point mass on a massless rod, y upwards. Half of the square: the reaction is λ (x, y).
#[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = (x^2 + y^2 - l^2)/2)]
pub struct RodPendulum {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

/// The same, the constraint given at velocity level.
#[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = dot((x^2 + y^2)/2))]
pub struct RodPendulumRates {
    pub m: f64,
    pub g: f64,
}

impl RodPendulum {
    pub const UNIT: Self = Self {
        m: 1.0,
        l: 1.0,
        g: 9.81,
    };

    /// Horizontal, at rest.
    pub fn horizontal(&self) -> State<2> {
        self.state([self.l, 0.0], [0.0, 0.0])
    }
}

impl RodPendulumRates {
    pub const UNIT: Self = Self { m: 1.0, g: 9.81 };

    pub fn horizontal(&self) -> State<2> {
        self.state([1.0, 0.0], [0.0, 0.0])
    }
}

/// A bead on the wire y = x⁴/4, y upwards: φ is not quadratic.
#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(wire) = y - x^4/4)]
pub struct Bead {
    pub g: f64,
}

/// The same, the constraint given at velocity level.
#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(wire) = dot(y - x^4/4))]
pub struct BeadRates {
    pub g: f64,
}

/// x = 1.2 on the wire.
pub const ON_WIRE: [f64; 2] = [1.2, 0.5184];

/// A bead on a wire that moves, with a force that depends on the velocity and has no potential.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y,
    constraint(wire) = y - x^4/4*(1 + sin(t)/5),
    force(x) = -c*dot(x)*(1 + y^2) + c*y,
    force(y) = c*x*dot(x),
)]
pub struct MovingWire {
    pub g: f64,
    pub c: f64,
}

/// A unit quaternion, scalar first, body to space, that carries a body with inertias i1, i2, i3 about a fixed point and the weight mg at
/// the distance d on the third axis. Off |e| = 1 the Lagrangian continues as the table's does.
#[dynamics(
    coordinates(e[4]),
    let w = body_rate(e),
    lagrangian = (i1*w[0]^2 + i2*w[1]^2 + i3*w[2]^2)/2 - mgd*(e[0]^2 - e[1]^2 - e[2]^2 + e[3]^2),
    constraint(unit) = (inner(e, e) - 1)/2,
    output(w1) = w[0],
    output(w2) = w[1],
    output(w3) = w[2],
)]
#[derive(Clone, Copy)]
pub struct QuaternionTop {
    pub i1: f64,
    pub i2: f64,
    pub i3: f64,
    pub mgd: f64,
}

impl QuaternionTop {
    /// J = diag(1, 1, ½), mgd = 1.
    pub const TABLE: Self = Self {
        i1: 1.0,
        i2: 1.0,
        i3: 0.5,
        mgd: 1.0,
    };

    /// The state with attitude `e` and body rates `w`.
    pub fn moving(&self, e: [f64; 4], w: [f64; 3]) -> State<4> {
        self.state(e, rate(e, w))
    }

    /// Tilted by ½ about the first axis, 6 about the third axis of the body.
    pub fn tilted(&self) -> State<4> {
        self.moving([0.25_f64.cos(), 0.25_f64.sin(), 0.0, 0.0], [0.0, 0.0, 6.0])
    }
}

/// ė = ½ e ∘ (0, w) for body rates w.
pub fn rate(e: [f64; 4], w: [f64; 3]) -> [f64; 4] {
    let [a, b, c] = w;
    [
        -e[1] * a - e[2] * b - e[3] * c,
        e[0] * a + e[2] * c - e[3] * b,
        e[0] * b + e[3] * a - e[1] * c,
        e[0] * c + e[1] * b - e[2] * a,
    ]
    .map(|twice| 0.5 * twice)
}

/// The axes of the body in space, the columns of the rotation matrix of `e`.
pub fn axes([a, b, c, d]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [
            a * a + b * b - c * c - d * d,
            2.0 * (b * c + a * d),
            2.0 * (b * d - a * c),
        ],
        [
            2.0 * (b * c - a * d),
            a * a - b * b + c * c - d * d,
            2.0 * (c * d + a * b),
        ],
        [
            2.0 * (b * d + a * c),
            2.0 * (c * d - a * b),
            a * a - b * b - c * c + d * d,
        ],
    ]
}

/// A blade on an incline: it slides along its heading φ, not across. x points downhill.
#[dynamics(
    coordinates(x, y, phi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(phi)^2 + m*g*sin(alpha)*x,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi),
)]
pub struct KnifeEdge {
    pub m: f64,
    pub j: f64,
    pub g: f64,
    pub alpha: f64,
}

impl KnifeEdge {
    /// m = I = 1 on an incline of 30°.
    pub const TABLE: Self = Self {
        m: 1.0,
        j: 1.0,
        g: 9.81,
        alpha: std::f64::consts::FRAC_PI_6,
    };

    /// From rest at the origin, turning at `rate`.
    pub fn turning(&self, rate: f64) -> State<3> {
        self.state([0.0; 3], [0.0, 0.0, rate])
    }
}

/// A blade on ground that moves: A and a depend on the time.
#[dynamics(
    coordinates(x, y, phi),
    lagrangian = (dot(x)^2 + dot(y)^2 + dot(phi)^2)/2 + 2*x - cos(phi)*y/3,
    constraint(blade) = dot(x)*sin(phi + t/3) - dot(y)*cos(phi + t/3) + x*sin(t)/5,
    force(phi) = -dot(phi)*c,
)]
pub struct MovingGround {
    pub c: f64,
}
