//! All rows of the table of references: single steps, and states along motions that are known to 12 digits and more.

use crate::common::{assert_close, count, list, number, numbers, reference, word};
use crate::models::{
    Bead, BeadRates, KnifeEdge, ON_WIRE, QuaternionTop, RodPendulum, RodPendulumRates,
};
use crate::runs::run;
use serde_json::Value;
use tfe::prelude::*;

/// One step of length h with n mixed nodes, as the row says: q and p.
fn one_step<M: Model<N>, const N: usize>(
    model: &M,
    start: State<N>,
    row: &Value,
) -> (Vec<f64>, Vec<f64>) {
    let h = number(&row["h"]);
    let motion = run(model, Element::mixed(count(&row["n"])), h, start, h);
    let end = motion.last();
    (end.q.to_vec(), end.p.to_vec())
}

/// Checks all rows of a list of single steps; `step` returns q and p for the name of the system.
fn check_steps(rows: &str, step: impl Fn(&str, &Value) -> (Vec<f64>, Vec<f64>)) {
    let table = reference("constraints");
    let mut compared = 0;
    for row in list(&table[rows]) {
        let system = word(&row["system"]);
        let what = format!(
            "{rows}: {system}, n = {}, h = {}",
            count(&row["n"]),
            number(&row["h"])
        );
        let (q, p) = step(system, row);
        // Momenta of the top are up to 6: 1e-13 is a few rounding errors of the last Newton correction.
        assert_close(&q, &numbers(&row["q1"]), 1e-13, &format!("{what}: q"));
        assert_close(&p, &numbers(&row["p1"]), 1e-13, &format!("{what}: p"));
        compared += 1;
    }
    assert_eq!(compared, 18, "the table lost rows");
}

#[test]
fn single_steps_with_position_constraints() {
    check_steps("one_step_V", |system, row| match system {
        "planar_pendulum" => one_step(&RodPendulum::UNIT, RodPendulum::UNIT.horizontal(), row),
        "bead_on_quartic" => {
            let bead = Bead { g: 9.81 };
            one_step(&bead, bead.state(ON_WIRE, [0.0; 2]), row)
        }
        "heavy_top_quaternion" => {
            one_step(&QuaternionTop::TABLE, QuaternionTop::TABLE.tilted(), row)
        }
        other => panic!("no system is called {other}"),
    });
}

#[test]
fn single_steps_with_velocity_constraints() {
    check_steps("one_step_S", |system, row| match system {
        "planar_pendulum" => one_step(
            &RodPendulumRates::UNIT,
            RodPendulumRates::UNIT.horizontal(),
            row,
        ),
        "bead_on_quartic" => {
            let bead = BeadRates { g: 9.81 };
            one_step(&bead, bead.state(ON_WIRE, [0.0; 2]), row)
        }
        "knife_edge" => one_step(&KnifeEdge::TABLE, KnifeEdge::TABLE.turning(1.3), row),
        other => panic!("no system is called {other}"),
    });
}

/// q and p after `time` with six mixed nodes.
fn end<M: Model<N>, const N: usize>(model: &M, start: State<N>, time: f64) -> Vec<f64> {
    let motion = run(model, Mixed::<6>, 0.02, start, time);
    motion.last().q.into_iter().chain(motion.last().p).collect()
}

#[test]
fn states_along_motions() {
    let table = reference("constraints");
    let mut compared = 0;
    for row in list(&table["exact_states"]) {
        let (system, time) = (word(&row["system"]), number(&row["t"]));
        let bead = (Bead { g: 9.81 }, BeadRates { g: 9.81 });
        let ends = match system {
            "planar_pendulum" => vec![
                end(&RodPendulum::UNIT, RodPendulum::UNIT.horizontal(), time),
                end(
                    &RodPendulumRates::UNIT,
                    RodPendulumRates::UNIT.horizontal(),
                    time,
                ),
            ],
            "bead_on_quartic" => vec![
                end(&bead.0, bead.0.state(ON_WIRE, [0.0; 2]), time),
                end(&bead.1, bead.1.state(ON_WIRE, [0.0; 2]), time),
            ],
            "heavy_top_quaternion" => {
                vec![end(
                    &QuaternionTop::TABLE,
                    QuaternionTop::TABLE.tilted(),
                    time,
                )]
            }
            "knife_edge" => vec![end(&KnifeEdge::TABLE, KnifeEdge::TABLE.turning(1.3), time)],
            other => panic!("no system is called {other}"),
        };
        // The reference of the bead has 12 digits; for the others, order 10 with h = 0.02 has a smaller error than
        // that.
        let tolerance = if system == "bead_on_quartic" {
            2e-11
        } else {
            1e-11
        };
        for actual in ends {
            assert_close(
                &actual,
                &numbers(&row["state"]),
                tolerance,
                &format!("{system} at t = {time}"),
            );
        }
        compared += 1;
    }
    assert_eq!(compared, 9, "the table lost rows");
}
