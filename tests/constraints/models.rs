//! The models that several files use.

use tfe::prelude::*;

/// A point mass on a massless rod, y upwards. The constraint is half of the difference of squares, so that the reaction
/// is λ (x, y).
#[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = (x^2 + y^2 - l^2)/2)]
pub struct RodPendulum {
    pub m: f64,
    pub l: f64,
    pub g: f64,
}

/// The same with the constraint on velocities.
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

/// A pendulum by its angle from the horizontal, with the moment of its weight: what mechanisms of one degree of freedom
/// are compared with.
#[dynamics(coordinates(angle), lagrangian = inertia/2*dot(angle)^2 - weight*sin(angle))]
pub struct Pendulum {
    pub inertia: f64,
    pub weight: f64,
}

/// A slider-crank: the crank of length one, the rod of length two without mass, and the slider on the line y = 0.
#[dynamics(
    coordinates(a, b, x),
    lagrangian = j/2*dot(a)^2 + k/2*dot(b)^2 + m/2*dot(x)^2 - g*sin(a),
    constraint(cx) = cos(a) + 2*cos(b) - x,
    constraint(cy) = sin(a) - 2*sin(b),
)]
pub struct SliderCrank {
    pub j: f64,
    pub k: f64,
    pub m: f64,
    pub g: f64,
}

impl SliderCrank {
    /// At an angle of the crank and a rate.
    pub fn turning(&self, a: f64, rate: f64) -> State<3> {
        let b = (a.sin() / 2.0).asin();
        let rate_b = rate * a.cos() / (2.0 * b.cos());
        let v = -a.sin() * rate - 2.0 * b.sin() * rate_b;
        self.state([a, b, a.cos() + 2.0 * b.cos()], [rate, rate_b, v])
    }
}

/// A bead on the wire y = x⁴/4, y upwards: φ is not quadratic.
#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(wire) = y - x^4/4)]
pub struct Bead {
    pub g: f64,
}

/// The same with the constraint on velocities.
#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - g*y, constraint(wire) = dot(y - x^4/4))]
pub struct BeadRates {
    pub g: f64,
}

/// The position x = 1.2 on the wire.
pub const ON_WIRE: [f64; 2] = [1.2, 0.5184];

/// A bead on a moving wire, with a velocity-dependent force without potential.
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

/// A unit quaternion, scalar first, from body to space, for a body with moments of inertia i1, i2, i3 about a fixed
/// point and the weight mg at the distance d on the third axis. For |e| ≠ 1 the Lagrangian is continued as in the
/// table.
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

    /// Tilted by ½ about the first axis, spinning at 6 about the third axis of the body.
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

/// A body on a blade on an incline: the blade, at the distance a behind the centre of mass (x, y), can slide along its
/// heading φ, not across. x points downhill.
#[dynamics(
    coordinates(x, y, phi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(phi)^2 + m*g*sin(alpha)*x,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi) + a*dot(phi),
)]
pub struct KnifeEdge {
    pub m: f64,
    pub j: f64,
    pub a: f64,
    pub g: f64,
    pub alpha: f64,
}

impl KnifeEdge {
    /// m = I = 1, the blade below the centre of mass, on an incline of 30°.
    pub const TABLE: Self = Self {
        m: 1.0,
        j: 1.0,
        a: 0.0,
        g: 9.81,
        alpha: std::f64::consts::FRAC_PI_6,
    };

    /// At the origin without speed, turning at `rate`.
    pub fn turning(&self, rate: f64) -> State<3> {
        self.state([0.0; 3], [0.0, 0.0, rate])
    }
}

/// A blade on moving ground: A and a depend on time.
#[dynamics(
    coordinates(x, y, phi),
    lagrangian = (dot(x)^2 + dot(y)^2 + dot(phi)^2)/2 + 2*x - cos(phi)*y/3,
    constraint(blade) = dot(x)*sin(phi + t/3) - dot(y)*cos(phi + t/3) + x*sin(t)/5,
    force(phi) = -dot(phi)*c,
)]
pub struct MovingGround {
    pub c: f64,
}

/// Andrews' squeezer: seven bodies in the plane by their angles, driven by a moment, against a spring (Schiehlen, *Multibody Systems Handbook*, 1990; names as in Hairer and Wanner II, VII.7).
#[dynamics(
    coordinates(beta, theta, gamma, phi, delta, omega, epsilon),
    let xa = -0.06934, let ya = -0.00227, let xb = -0.03635, let yb = 0.03273, let xc = 0.014, let yc = 0.072,
    let d = 0.028, let da = 0.0115, let e = 0.02, let ea = 0.01421, let rr = 0.007, let ra = 0.00092, let l0 = 0.07785,
    let ss = 0.035, let sa = 0.01874, let sb = 0.01043, let sc = 0.018, let sd = 0.02, let ta = 0.02308, let tb = 0.00916,
    let u = 0.04, let ua = 0.01228, let ub = 0.00449, let zf = 0.02, let zt = 0.04, let fa = 0.01421,
    let x1 = ra*cos(beta), let y1 = ra*sin(beta),
    let x2 = rr*cos(beta) - da*cos(beta + theta), let y2 = rr*sin(beta) - da*sin(beta + theta),
    let x3 = xb + sa*sin(gamma) + sb*cos(gamma), let y3 = yb - sa*cos(gamma) + sb*sin(gamma),
    let x4 = xa + zt*cos(delta) + (e - ea)*sin(phi + delta), let y4 = ya + zt*sin(delta) - (e - ea)*cos(phi + delta),
    let x5 = xa + ta*cos(delta) - tb*sin(delta), let y5 = ya + ta*sin(delta) + tb*cos(delta),
    let x6 = xa + u*sin(epsilon) + (zf - fa)*cos(omega + epsilon), let y6 = ya - u*cos(epsilon) + (zf - fa)*sin(omega + epsilon),
    let x7 = xa + ua*sin(epsilon) - ub*cos(epsilon), let y7 = ya - ua*cos(epsilon) - ub*sin(epsilon),
    let xd = sd*cos(gamma) + sc*sin(gamma) + xb, let yd = sd*sin(gamma) - sc*cos(gamma) + yb,
    lagrangian = 0.04325/2*(dot(x1)^2 + dot(y1)^2) + 2.194e-6/2*dot(beta)^2
        + 0.00365/2*(dot(x2)^2 + dot(y2)^2) + 4.410e-7/2*(dot(beta) + dot(theta))^2
        + 0.02373/2*(dot(x3)^2 + dot(y3)^2) + 5.255e-6/2*dot(gamma)^2
        + 0.00706/2*(dot(x4)^2 + dot(y4)^2) + 5.667e-7/2*(dot(phi) + dot(delta))^2
        + 0.07050/2*(dot(x5)^2 + dot(y5)^2) + 1.169e-5/2*dot(delta)^2
        + 0.00706/2*(dot(x6)^2 + dot(y6)^2) + 5.667e-7/2*(dot(omega) + dot(epsilon))^2
        + 0.05498/2*(dot(x7)^2 + dot(y7)^2) + 1.912e-5/2*dot(epsilon)^2
        - 4530/2*(sqrt((xd - xc)^2 + (yd - yc)^2) - l0)^2,
    force(beta) = 0.033,
    constraint(x_3) = rr*cos(beta) - d*cos(beta + theta) - ss*sin(gamma) - xb,
    constraint(y_3) = rr*sin(beta) - d*sin(beta + theta) + ss*cos(gamma) - yb,
    constraint(x_4) = rr*cos(beta) - d*cos(beta + theta) - e*sin(phi + delta) - zt*cos(delta) - xa,
    constraint(y_4) = rr*sin(beta) - d*sin(beta + theta) + e*cos(phi + delta) - zt*sin(delta) - ya,
    constraint(x_6) = rr*cos(beta) - d*cos(beta + theta) - zf*cos(omega + epsilon) - u*sin(epsilon) - xa,
    constraint(y_6) = rr*sin(beta) - d*sin(beta + theta) - zf*sin(omega + epsilon) + u*cos(epsilon) - ya,
)]
pub struct Andrews;

impl Andrews {
    /// At rest.
    pub fn at_rest(&self) -> State<7> {
        let q = [
            -0.06171389001427645,
            0.0,
            0.45527981916307037,
            0.22266839016588588,
            0.48736497954384254,
            -0.22266839016588588,
            1.2305474445498212,
        ];
        self.state(q, [0.0; 7])
    }
}
