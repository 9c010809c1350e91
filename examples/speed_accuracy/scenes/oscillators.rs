//! Systems with few coordinates and smooth motions.

use super::{Start, steps};
use tfe::prelude::*;

/// A pendulum; time in units of √(l/g).
#[dynamics(coordinates(q), lagrangian = dot(q)^2/2 + cos(q))]
pub struct Pendulum {}

pub const PENDULUM: Pendulum = Pendulum {};

pub const PENDULUM_START: Start<1> = Start {
    q: [2.0],
    v: [0.0],
    end: 10.0,
};

/// From rest at two radians. The reference at the end was computed with 32 digits.
pub fn pendulum() -> WorkPrecision<'static, Pendulum, State<1>> {
    let Start { q, v, end } = PENDULUM_START;
    WorkPrecision::new(&PENDULUM, PENDULUM.state(q, v), 0.0..end)
        .steps(steps(end, 2, 200))
        .reference_end([0.7131481806013794], [-1.5313085041358347])
}

/// The Hénon–Heiles system: a star in a galaxy.
#[dynamics(coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2*y - y^3/3)]
pub struct HenonHeiles {}

pub const HENON_HEILES_START: Start<2> = Start {
    q: [0.1, 0.0],
    v: [0.0, 0.5],
    end: 100.0,
};

/// A chaotic orbit. The reference at the end was computed with 20 digits.
pub fn henon_heiles() -> WorkPrecision<'static, HenonHeiles, State<2>> {
    let Start { q, v, end } = HENON_HEILES_START;
    WorkPrecision::new(&HenonHeiles {}, State { q, p: v }, 0.0..end)
        .steps(steps(end, 30, 2000))
        .reference_end(
            [-0.040_194_237_876_068_82, 0.679_016_921_772_021_6],
            [0.038_450_928_951_859_83, 0.048_594_831_533_003_55],
        )
}

#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + g*(2*cos(a) + cos(b)),
)]
pub struct DoublePendulum {
    pub g: f64,
}

pub const DOUBLE_PENDULUM: DoublePendulum = DoublePendulum { g: 9.81 };

pub const DOUBLE_PENDULUM_START: Start<2> = Start {
    q: [0.5, -0.3],
    v: [0.0, 0.0],
    end: 10.0,
};

/// Two equal point masses on massless rods of one metre, in regular motion. The reference at the end has 13 digits.
pub fn double_pendulum() -> WorkPrecision<'static, DoublePendulum, State<2>> {
    let Start { q, v, end } = DOUBLE_PENDULUM_START;
    let last = DOUBLE_PENDULUM.state(
        [-0.107_542_332_622_4, 0.387_937_148_385_3],
        [1.800_047_274_825, -1.734_236_997_103],
    );
    WorkPrecision::new(&DOUBLE_PENDULUM, DOUBLE_PENDULUM.state(q, v), 0.0..end)
        .steps(steps(end, 20, 1000))
        .reference_end(last.q, last.p)
        .reference_uncertainty(1e-12)
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
pub struct VanDerPol {
    pub mu: f64,
}

pub const VAN_DER_POL: VanDerPol = VanDerPol { mu: 1.0 };

pub const VAN_DER_POL_START: Start<1> = Start {
    q: [1.0],
    v: [0.0],
    end: 20.0,
};

/// Approaches the limit cycle and goes around it three times; energy is not conserved.
pub fn van_der_pol() -> WorkPrecision<'static, VanDerPol, State<1>> {
    let Start { q, v, end } = VAN_DER_POL_START;
    WorkPrecision::new(&VAN_DER_POL, VAN_DER_POL.state(q, v), 0.0..end).steps(steps(end, 20, 800))
}
