//! Impulses on models of run-time length.

use crate::common::distance;
use crate::lengths::states_apart;
use tfe::error::RunErrorKind;
use tfe::family;
use tfe::prelude::*;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + a/4*(q[i+1]-q[i])^4),
)]
pub struct Chain {
    pub n: usize,
    pub a: f64,
}

#[dynamics(
    coordinates(q[5]),
    lagrangian = sum(i in 0..5, dot(q[i])^2/2) - sum(i in 0..4, (q[i+1]-q[i])^2/2 + a/4*(q[i+1]-q[i])^4),
)]
struct FiveMasses {
    a: f64,
}

const CHAIN: Chain = Chain { n: 5, a: 0.7 };
const Q: [f64; 5] = [0.3, -0.1, 0.4, 0.0, 0.2];
const BLOW: [f64; 5] = [0.5, 0.0, -1.0, 0.0, 0.25];

fn struck(times: &[f64]) -> family::Simulation<'static, Chain> {
    let simulation = Simulation::new(&CHAIN).element(Mixed::<5>).step(0.05);
    (times.iter()).fold(simulation, |run, time| run.impulse(*time, BLOW))
}

/// Compared with steps of a model of fixed size, with a break that makes the times of the impulses nodes.
#[test]
fn they_do_what_they_do_to_models_of_fixed_size() {
    let times = [0.0, 0.51, 1.25];
    let run = struck(&times).run(CHAIN.state(Q, [0.0; 5]), 0.0..2.0);
    let fixed = FiveMasses { a: 0.7 };
    let simulation = Simulation::new(&fixed).element(Mixed::<5>).step(0.05);
    let simulation = (times.iter()).fold(simulation, |run, time| {
        run.break_at(*time).impulse(*time, BLOW)
    });
    let other = simulation.run(fixed.state(Q, [0.0; 5]), 0.0..2.0);
    let (run, other) = (run.expect("a good run"), other.expect("a good run"));
    let off = states_apart(&run.last().state(), &other.last().state());
    assert!(off < 1e-13, "{off:e}");
    assert_eq!(run.warnings(), &[]);
}

#[test]
fn nodes_show_the_momentum_before_them() {
    let run = struck(&[0.5]).run(CHAIN.state(Q, [0.0; 5]), 0.0..1.0);
    let run = run.expect("a good run");
    let total = |node: usize| run.states()[node].p.iter().sum::<f64>();
    let expected: f64 = BLOW.iter().sum();
    assert_eq!(run.states()[10].t, 0.5);
    assert!(total(10).abs() < 1e-15 && (total(11) - expected).abs() < 1e-15);
}

/// Runs, halves of runs and single steps have the same bits, also if the halves meet at an impulse.
#[test]
fn halves_and_steps_are_one_run() {
    let times = [0.0, 0.25, 0.5];
    let start = || CHAIN.state(Q, [0.1; 5]);
    let whole = struck(&times).run(start(), 0.0..1.0).expect("a good run");
    let first = struck(&times).run(start(), 0.0..0.5);
    let first = first.expect("a good run");
    let checkpoint = first.checkpoint().expect("a complete run");
    let second = struck(&times).resume(checkpoint, 1.0).expect("a good run");
    assert_eq!(second.states(), &whole.states()[10..]);
    let steps = struck(&times).steps(start(), 0.0).take(20);
    for (node, step) in whole.states()[1..].iter().zip(steps) {
        assert_eq!(node, &step.expect("a good step"));
    }
}

/// A break changes the grid, so that the second half begins its own: impulses that have acted are before its span.
#[test]
fn halves_off_the_grid_leave_impulses_behind() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^4/4)]
    struct Single;
    let (element, step) = (Mixed::<8>, 0.1);
    let long = struck(&[0.22]).element(element).break_at(0.37);
    let start = || CHAIN.state(Q, [0.1; 5]);
    let fixed = Simulation::new(&Single).element(element).step(step);
    let fixed = fixed.impulse(0.22, [1.5]).break_at(0.22).break_at(0.37);
    let single = || Single.state([1.0], [0.0]);
    for (from, to) in [(0.0, 1.0), (0.5, 0.0)] {
        let middle = 0.5 * (from + to) + 0.15 * (to - from);
        let whole = long.run(start(), from..to).expect("a good run");
        let first = long.run(start(), from..middle).expect("a good run");
        let checkpoint = first.checkpoint().expect("a complete run");
        let second = long.resume(checkpoint, to).expect("a good run");
        assert!(distance(&second.last().q, &whole.last().q) < 1e-13);

        let whole = fixed.run(single(), from..to).expect("a good run");
        let first = fixed.run(single(), from..middle).expect("a good run");
        let checkpoint = first.checkpoint().expect("a complete run");
        let second = fixed.resume(checkpoint, to).expect("a good run");
        assert!((second.last().q[0] - whole.last().q[0]).abs() < 1e-13);
    }
}

#[test]
fn what_cannot_act_is_refused() {
    let start = || CHAIN.state(Q, [0.0; 5]);
    let kind = |run: family::Simulation<'static, Chain>| {
        let error = run.run(start(), 0.0..1.0).expect_err("no good impulse");
        error.kind().clone()
    };
    let run = Simulation::new(&CHAIN).step(0.1);
    let wrong = family::ModelError::StateLength {
        vector: "of an impulse",
        length: 3,
        expected: 5,
    };
    assert_eq!(
        kind(run.clone().impulse(0.5, [1.0; 3])),
        RunErrorKind::Family(wrong)
    );
    for (time, value) in [(1.5, 1.0), (f64::INFINITY, 1.0), (0.5, f64::INFINITY)] {
        assert_eq!(
            kind(run.clone().impulse(time, [value; 5])),
            RunErrorKind::Impulse { time }
        );
    }
    // Also where it would be a break.
    let found = kind(run.impulse(f64::NAN, [1.0; 5]));
    assert!(
        matches!(found, RunErrorKind::Impulse { time } if time.is_nan()),
        "{found}"
    );
}

#[test]
fn estimates_go_across_them() {
    let start = || CHAIN.state(Q, [0.0; 5]);
    let fine = struck(&[0.5]).element(Mixed::<8>).step(0.01);
    let fine = fine.run(start(), 0.0..1.0).expect("a good run");
    let accurate = struck(&[0.5]).accuracy(1e-6).run(start(), 0.0..1.0);
    let estimated = struck(&[0.5]).run_estimated(start(), 0.0..1.0);
    for run in [accurate, estimated] {
        let run = run.expect("a good run");
        let off = distance(&run.last().q, &fine.last().q);
        let error = run.error_estimate();
        assert!(off <= 2.0 * error + 1e-14 && error < 1e-6, "{off} {error}");
    }
}

/// An impulse on a rod acts perpendicular to it only.
#[cfg(feature = "sparse")]
#[test]
fn constraints_take_up_what_is_against_them() {
    #[dynamics(
        coordinates(x[n], y[n]),
        lagrangian = sum(i in 0..n, (dot(x[i])^2 + dot(y[i])^2)/2 - y[i]),
        constraint(rod[i in 0..n]) = x[i]^2 + y[i]^2 - 1,
    )]
    struct Rods {
        n: usize,
    }
    let rods = Rods { n: 2 };
    let run = Simulation::new(&rods).step(0.1);
    let run = run.impulse(0.0, [3.0, 0.0, 0.25, 5.0]);
    // One rod lies along x, with an impulse along it and one across; the other hangs, with an impulse along it.
    let start = rods.state([1.0, 0.0, 0.0, -1.0], [0.0; 4]);
    let motion = run.run(start, 0.0..0.5).expect("a good run");
    let node = &motion.states()[1];
    let energy = |i: usize| {
        let (v, w) = (node.v[i], node.v[2 + i]);
        (v * v + w * w) / 2.0 + node.q[2 + i]
    };
    assert!((energy(0) - 0.25_f64.powi(2) / 2.0).abs() < 1e-9);
    assert!((energy(1) + 1.0).abs() < 1e-14);
    assert!(motion.constraint_residual().position < 1e-12);
}
