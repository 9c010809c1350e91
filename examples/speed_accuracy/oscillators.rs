//! Few coordinates, smooth motions.

use crate::Outcome;
use crate::runs::Scene;
use tfe::prelude::*;

/// In units of √(l/g).
#[dynamics(coordinates(q), lagrangian = dot(q)^2/2 + cos(q))]
struct Pendulum {}

/// From rest at two radians; the end by 32 digits of arithmetic.
pub fn pendulum() -> Outcome {
    let model = Pendulum {};
    let problem = WorkPrecision::new(&model, model.state([2.0], [0.0]), 0.0..10.0)
        .steps([2.0, 1.0, 0.5, 0.25, 0.1, 0.05, 0.025])
        .reference_end([0.7131481806013794], [-1.5313085041358347]);
    Ok(Scene::measure("Pendulum", problem)?)
}

/// A star in a galaxy.
#[dynamics(coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2*y - y^3/3)]
struct HenonHeiles {}

/// A chaotic one. The end by 20 digits of arithmetic.
pub fn henon_heiles() -> Outcome {
    let start = State {
        q: [0.1, 0.0],
        p: [0.0, 0.5],
    };
    let problem = WorkPrecision::new(&HenonHeiles {}, start, 0.0..100.0)
        .steps([2.0, 1.0, 0.5, 0.25, 0.1, 0.05])
        .reference_end(
            [-0.040_194_237_876_068_82, 0.679_016_921_772_021_6],
            [0.038_450_928_951_859_83, 0.048_594_831_533_003_55],
        );
    Ok(Scene::measure("Hénon–Heiles", problem)?)
}

#[dynamics(
    coordinates(a, b),
    lagrangian = dot(a)^2 + dot(b)^2/2 + dot(a)*dot(b)*cos(a - b) + g*(2*cos(a) + cos(b)),
)]
struct DoublePendulum {
    g: f64,
}

/// Two equal point masses on rods of one metre, in regular motion. Its end is known to 13 digits.
pub fn double_pendulum() -> Outcome {
    let model = DoublePendulum { g: 9.81 };
    let start = model.state([0.5, -0.3], [0.0, 0.0]);
    let end = model.state(
        [-0.107_542_332_622_4, 0.387_937_148_385_3],
        [1.800_047_274_825, -1.734_236_997_103],
    );
    let problem = WorkPrecision::new(&model, start, 0.0..10.0)
        .steps([0.5, 0.25, 0.1, 0.05, 0.025, 0.01])
        .reference_end(end.q, end.p)
        .reference_uncertainty(1e-12);
    Ok(Scene::measure("Double pendulum", problem)?)
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
struct VanDerPol {
    mu: f64,
}

/// Onto its limit cycle and three times around; energy is no invariant.
pub fn van_der_pol() -> Outcome {
    let model = VanDerPol { mu: 1.0 };
    let problem = WorkPrecision::new(&model, model.state([1.0], [0.0]), 0.0..20.0)
        .steps([1.0, 0.5, 0.25, 0.1, 0.05, 0.025]);
    Ok(Scene::measure("Van der Pol", problem)?)
}
