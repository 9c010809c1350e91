//! Multipliers at nodes: the reaction force of each constraint.

use crate::models::{KnifeEdge, RodPendulum, RodPendulumRates};
use crate::runs::run;
use tfe::prelude::*;

/// λ (x, y) is the force of the rod: λ l = m g y/l − m v²/l.
#[track_caller]
fn check_rod(motion: &Motion<2>, model: &RodPendulum, tolerance: f64) {
    let reactions = motion.reactions();
    assert_eq!(reactions.names().len(), 1);
    assert_eq!(reactions.names()[0], "rod");
    assert!(reactions.column("wire").is_none());
    let column = reactions.column("rod").expect("declared");
    assert_eq!(column.len(), motion.states().len());
    assert!(reactions.row(column.len()).is_none());
    assert!(reactions.row(usize::MAX).is_none());
    for (k, (node, v)) in motion.states().iter().zip(motion.velocities()).enumerate() {
        let speed2 = v[0] * v[0] + v[1] * v[1];
        let expected = model.m * (model.g * node.q[1] - speed2) / (model.l * model.l);
        assert_eq!(reactions.row(k), Some(&[column[k]][..]));
        assert!(
            (column[k] - expected).abs() <= tolerance,
            "t = {}: λ = {}, expected {expected}",
            node.t,
            column[k]
        );
    }
}

#[test]
fn the_pull_of_the_rod() {
    let model = RodPendulum {
        m: 0.7,
        l: 1.3,
        g: 9.81,
    };
    let start = model.state([1.3, 0.0], [0.0, -0.8]);
    for element in [
        Element::mixed(2),
        Element::mixed(4),
        Element::primal(3),
        Element::primal(4).lobatto(),
    ] {
        // λ is a function of the state at the node, and is therefore right up to rounding whatever the error of the
        // state. It is up to 20.
        check_rod(&run(&model, element, 0.02, start, 3.0), &model, 1e-12);
    }
}

#[test]
fn the_pull_is_the_same_at_velocity_level() {
    let model = RodPendulumRates::UNIT;
    let motion = run(&model, Mixed::<5>, 0.01, model.horizontal(), 3.0);
    check_rod(&motion, &RodPendulum::UNIT, 1e-11);
}

/// The closed form of the reaction as a function of the position: λ = 3 m g y from horizontal rest, l = 1.
#[test]
fn the_pull_over_the_angle() {
    let model = RodPendulum::UNIT;
    let motion = run(&model, Mixed::<6>, 0.01, model.horizontal(), 2.0);
    let pull = motion.reactions().column("rod").expect("declared");
    for (node, pull) in motion.states().iter().zip(pull) {
        // The energy, and with it v², has an error of 1e-12.
        assert!(
            (pull - 3.0 * model.g * node.q[1]).abs() < 1e-11,
            "t = {}: λ = {pull}",
            node.t
        );
    }
}

/// Across the blade, the reaction balances centripetal force and weight: λ (sin φ, −cos φ) with λ = −m u φ̇ − m gs sin
/// φ, where u is the speed along it.
#[test]
fn the_side_force_of_the_blade() {
    let model = KnifeEdge::TABLE;
    let (w, gs) = (1.3, model.g * model.alpha.sin());
    let motion = run(&model, Mixed::<6>, 0.02, model.turning(w), 5.0);
    let force = motion.reactions().column("blade").expect("declared");
    for (node, force) in motion.states().iter().zip(force) {
        let along = gs / w * (w * node.t).sin();
        let expected = -along * w - gs * (w * node.t).sin();
        assert!(
            (force - expected).abs() < 1e-11,
            "t = {}: λ = {force}, expected {expected}",
            node.t
        );
    }
}
