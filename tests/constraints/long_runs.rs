//! A hundred thousand steps: constraints hold and energy errors oscillate, without drift.

use crate::common::larger;
use crate::models::{
    Bead, BeadRates, KnifeEdge, ON_WIRE, QuaternionTop, RodPendulum, RodPendulumRates,
};
use crate::runs::run;
use tfe::prelude::*;

const STEPS: usize = 100_000;

/// Rounding errors grow as the square root of the number of steps: 3e-14 for energies up to 10.
const WALK: f64 = 2e-12;

/// The energy error of the last tenth has the same envelope and mean as that of the first, except for rounding errors
/// up to `floor`.
#[track_caller]
fn assert_no_drift<const N: usize>(motion: &Motion<N>, floor: f64, what: &str) {
    let energies = motion.energies();
    assert_eq!(energies.len(), STEPS + 1, "{what}");
    let tenth = STEPS / 10;
    let swing = |part: &[f64]| {
        let mean = part.iter().map(|e| e - energies[0]).sum::<f64>() / part.len() as f64;
        let most = part
            .iter()
            .map(|e| (e - energies[0]).abs())
            .fold(0.0, larger);
        (mean, most)
    };
    let (first, last) = (
        swing(&energies[..tenth]),
        swing(&energies[energies.len() - tenth..]),
    );
    // A tenth contains a hundred periods or more: the mean over an incomplete period remains, 1 % of the envelope.
    assert!(
        last.1 <= 1.02 * first.1 + floor,
        "{what}: energy error up to {:.3e} at first, {:.3e} at last",
        first.1,
        last.1
    );
    assert!(
        (last.0 - first.0).abs() <= 0.03 * first.1 + floor,
        "{what}: mean energy error {:.3e} at first, {:.3e} at last, up to {:.3e}",
        first.0,
        last.0,
        first.1
    );
}

#[track_caller]
fn check<M: Model<N>, const N: usize>(
    model: &M,
    start: State<N>,
    step: f64,
    floor: f64,
    what: &str,
) -> Motion<N> {
    let motion = run(model, Mixed::<3>, step, start, STEPS as f64 * step);
    assert_eq!(motion.states().len(), STEPS + 1, "{what}");
    let residual = motion.constraint_residual();
    assert!(
        residual.velocity <= 1e-12,
        "{what}: |A v + a| up to {:.1e}",
        residual.velocity
    );
    assert_eq!(residual.rank, 1, "{what}");
    assert_no_drift(&motion, floor, what);
    motion
}

/// As [`check`], and also φ = 0 at every node.
#[track_caller]
fn check_positions<M: Model<N>, const N: usize>(model: &M, start: State<N>, step: f64, what: &str) {
    let motion = check(model, start, step, WALK, what);
    let residual = motion.constraint_residual();
    assert!(
        residual.position <= 1e-12,
        "{what}: |φ| up to {:.1e}",
        residual.position
    );
}

#[test]
fn the_rod() {
    let model = RodPendulum::UNIT;
    check_positions(&model, model.horizontal(), 0.05, "rod");
}

#[test]
fn the_bead() {
    let model = Bead { g: 9.81 };
    check_positions(&model, model.state(ON_WIRE, [0.0; 2]), 0.02, "bead");
}

#[test]
fn the_quaternion_top() {
    let model = QuaternionTop::TABLE;
    check_positions(&model, model.tilted(), 0.02, "quaternion top");
}

#[test]
fn the_rod_at_velocity_level() {
    let model = RodPendulumRates::UNIT;
    let motion = check(
        &model,
        model.horizontal(),
        0.05,
        WALK,
        "rod at velocity level",
    );
    // φ is quadratic and conserved by the element, up to a random walk of rounding errors, about √1e5 · 2e-16.
    let most = motion
        .states()
        .iter()
        .map(|node| ((node.q[0].powi(2) + node.q[1].powi(2) - 1.0) / 2.0).abs())
        .fold(0.0, larger);
    assert!(most <= 1e-12, "|φ| up to {most:.1e}");
}

#[test]
fn the_bead_at_velocity_level() {
    let model = BeadRates { g: 9.81 };
    let start = model.state(ON_WIRE, [0.0; 2]);
    let motion = check(&model, start, 0.02, WALK, "bead at velocity level");
    // φ is not quadratic: its error is of the order h⁴ but does not grow. The reference found 6.77e-8 in a tenth of the
    // steps.
    let off = |nodes: &[Node<2>]| {
        nodes
            .iter()
            .map(|node| (node.q[1] - node.q[0].powi(4) / 4.0).abs())
            .fold(0.0, larger)
    };
    let tenth = STEPS / 10;
    let (first, last) = (
        off(&motion.states()[..tenth]),
        off(&motion.states()[STEPS - tenth..]),
    );
    assert!((first - 6.77e-8).abs() < 1e-9, "|φ| up to {first:.3e}");
    assert!(last <= 1.01 * first, "|φ| {first:.3e}, then {last:.3e}");
}

#[test]
fn the_knife_edge() {
    let model = KnifeEdge::TABLE;
    // The heading grows to 2600, where a rounding error is 4e-13. Each rotates the next step, whose work is h gs u ≤
    // 0.4, by that angle; their random walk is 5e-11. Without the symmetric gauge the energy would have drifted by
    // 8e-7.
    let motion = check(&model, model.turning(1.3), 0.02, 1e-10, "knife edge");
    // The blade oscillates downhill, and moves across the slope with a mean velocity of gs/2w: the closed form, with a
    // phase error of order h⁴.
    let end = motion.last();
    let (w, gs, t) = (1.3, 9.81 / 2.0, end.t);
    let y = gs / (2.0 * w * w) * (w * t - (2.0 * w * t).sin() / 2.0);
    assert!(
        (end.q[1] / y - 1.0).abs() < 1e-7,
        "y = {}, expected {y}",
        end.q[1]
    );
}
