//! Motions under gravity.

use super::{Start, steps};
use tfe::prelude::*;

#[dynamics(coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2)/2 - 1/sqrt(x^2 + y^2))]
pub struct Kepler {}

pub const KEPLER_START: Start<2> = Start {
    q: [0.4, 0.0],
    v: [0.0, 2.0],
    end: 20.0,
};

/// Eccentricity 0.6, three revolutions from the pericentre. The reference at the end was computed with 32 digits.
pub fn kepler() -> WorkPrecision<'static, Kepler, State<2>> {
    let Start { q, v, end } = KEPLER_START;
    WorkPrecision::new(&Kepler {}, State { q, p: v }, 0.0..end)
        .steps(steps(end, 30, 800))
        .reference_end(
            [-0.770_075_578_411_240_4, 0.788_344_816_994_424_4],
            [-0.894_183_731_988_691_5, -0.123_461_764_158_440_96],
        )
}

/// Bodies that attract each other; `x`, `y`, `z` are the coordinates of all of them.
#[dynamics(
    coordinates(x[6], y[6], z[6]),
    lagrangian = sum(i in 0..6, m[i]/2*(dot(x[i])^2 + dot(y[i])^2 + dot(z[i])^2))
        + sum(i in 1..6, sum(j in 0..i, g*m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2 + (z[i] - z[j])^2))),
)]
pub struct Bodies {
    pub g: f64,
    pub m: [f64; 6],
}

/// The Sun with the inner planets, Jupiter, Saturn, Uranus, Neptune and Pluto: masses in solar masses, positions in
/// astronomical units, velocities per day [Hairer, Lubich, Wanner, Geometric Numerical Integration, I.2.4].
const BODIES: [(f64, [f64; 3], [f64; 3]); 6] = [
    (1.000_005_976_82, [0.0; 3], [0.0; 3]),
    (
        0.000_954_786_104_043,
        [-3.502_365_3, -3.816_984_7, -1.550_796_3],
        [0.005_654_29, -0.004_124_90, -0.001_905_89],
    ),
    (
        0.000_285_583_733_151,
        [9.075_531_4, -3.045_835_3, -1.648_370_8],
        [0.001_683_18, 0.004_835_25, 0.001_924_62],
    ),
    (
        0.000_043_727_316_454_6,
        [8.310_142_0, -16.290_108_6, -7.252_127_8],
        [0.003_541_78, 0.001_371_02, 0.000_550_29],
    ),
    (
        0.000_051_775_913_844_9,
        [11.470_766_6, -25.729_482_9, -10.816_945_6],
        [0.002_889_30, 0.001_145_27, 0.000_396_77],
    ),
    (
        1.0 / 1.3e8,
        [-15.538_735_7, -25.222_559_4, -3.190_238_2],
        [0.002_767_25, -0.001_707_02, -0.001_365_04],
    ),
];

pub const SOLAR_SYSTEM: Bodies = Bodies {
    g: 2.959_122_082_86e-4,
    m: [
        BODIES[0].0,
        BODIES[1].0,
        BODIES[2].0,
        BODIES[3].0,
        BODIES[4].0,
        BODIES[5].0,
    ],
};

/// 27 years, about two and a quarter revolutions of Jupiter.
pub fn solar_system_start() -> Start<18> {
    let (mut q, mut v) = ([0.0; 18], [0.0; 18]);
    for (i, (_, position, velocity)) in BODIES.iter().enumerate() {
        for k in 0..3 {
            (q[6 * k + i], v[6 * k + i]) = (position[k], velocity[k]);
        }
    }
    Start {
        q,
        v,
        end: 10_000.0,
    }
}

pub fn solar_system() -> WorkPrecision<'static, Bodies, State<18>> {
    let Start { q, v, end } = solar_system_start();
    WorkPrecision::new(&SOLAR_SYSTEM, SOLAR_SYSTEM.state(q, v), 0.0..end).steps(steps(end, 5, 200))
}
