//! Control loops.

use crate::{DRIVING, Mass, w};
use tfe::prelude::*;
use tfe::{HeldNode, InputError, RunErrorKind};

/// A control loop gives the same as a table of the same values.
#[test]
fn a_loop_holds_what_was_set() {
    let start = DRIVING.state([0.3], [0.0]);
    let mut run = Simulation::new(&DRIVING)
        .step(0.02)
        .input("w", w)
        .hold(start, 0.0)
        .unwrap();
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        let node = run.node();
        let torque = -2.0 * node.q[0] - 0.5 * node.v[0];
        times.push(node.t);
        values.push(torque);
        run.set("u", torque);
        run.advance().unwrap();
        let node = run.node();
        assert_eq!(node.output("torque"), Some(torque - DRIVING.c * node.v[0]));
    }
    assert_eq!(run.statistics().steps, 200);
    let table = Simulation::new(&DRIVING).step(0.02).input("w", w).table(
        "u",
        &times,
        &values,
        Interpolation::Hold,
    );
    let motion = table.run(start, 0.0..run.node().t).unwrap();
    assert!((motion.last().q[0] - run.node().q[0]).abs() < 1e-12);
}

/// Feedback laws sampled at their own rates: the same as setting the inputs by hand at these times.
#[test]
fn feedback_is_sampled_with_its_own_rate() {
    let start = Mass.state([1.0], [0.3]);
    let hold = || {
        Simulation::new(&Mass)
            .step(0.02)
            .hold(start, 0.5)
            .expect("a loop")
    };
    let (mut sampled, mut by_hand) = (hold(), hold());
    sampled
        .sample("u", 0.1, |node| -node.q[0])
        .expect("an input");
    sampled
        .sample("w", 0.06, |node| -0.5 * node.v[0])
        .expect("an input");
    for step in 0..600 {
        let node = by_hand.node().clone();
        if step % 5 == 0 {
            by_hand.set("u", -node.q[0]);
        }
        if step % 3 == 0 {
            by_hand.set("w", -0.5 * node.v[0]);
        }
        by_hand.advance().expect("a step");
        sampled.advance().expect("a step");
        assert_eq!(sampled.node(), by_hand.node(), "step {step}");
    }
    let told = |result: Result<(), RunErrorKind>| match result {
        Err(RunErrorKind::Input(InputError::Sampling { .. })) => true,
        other => panic!("{other:?}"),
    };
    assert!(told(hold().sample("u", 0.0, |_| 0.0)));
    assert!(told(hold().sample("u", 5e-324, |_| 0.0)));
    assert!(hold().sample("v", 0.1, |_| 0.0).is_err());
    let mut between = hold();
    between
        .sample("u", 0.05, |_| 0.0)
        .expect("a positive period");
    let mut results = (0..3).map(|_| between.advance());
    assert!(results.next().is_some_and(|first| first.is_ok()));
    assert!(results.any(|one| one.is_err()) || told(between.advance()));
}

/// If an event stops the loop, the outputs of its last node are those at this node.
#[test]
fn outputs_of_a_loop_that_is_stopped_are_those_of_its_end() {
    let mut held = Simulation::new(&Mass)
        .step(0.3)
        .on("wall", Crossing::Falling, |_| Act::Stop)
        .hold(Mass.state([0.0], [1.0]), 0.0)
        .expect("a loop");
    for _ in 0..3 {
        held.advance().expect("a step");
    }
    let node = held.node();
    assert!((node.t - 0.75).abs() < 1e-12, "{node:?}");
    assert_eq!(node.output("place"), Some(node.q[0]));
    assert!(held.advance().is_err());
}

/// At late times, rounding errors of the time are a considerable part of a short sampling time.
#[test]
fn feedback_is_sampled_at_late_times() {
    use std::sync::atomic::{AtomicU32, Ordering};

    let asked = AtomicU32::new(0);
    let start = Mass.state([1.0], [0.0]);
    let held = Simulation::new(&Mass).step(1e-3).hold(start, 1e5);
    let mut held = held.expect("a loop");
    let law = |node: &HeldNode<1>| {
        asked.fetch_add(1, Ordering::Relaxed);
        -node.q[0]
    };
    held.sample("u", 1e-3, law).expect("an input");
    for _ in 0..20 {
        held.advance().expect("a step");
    }
    assert_eq!(asked.load(Ordering::Relaxed), 20);
}

/// Setting an input may cause an event at once: bounds derived with the previous input must not be used any more.
#[test]
fn events_of_what_is_held_are_met() {
    #[dynamics(
        coordinates(theta),
        lagrangian = dot(theta)^2/2 + cos(theta),
        input(limit),
        event(trip) = limit - theta,
    )]
    struct Guarded;

    let hold = |speed: f64| {
        Simulation::new(&Guarded)
            .step(0.01)
            .on("trip", Crossing::Falling, |_| Act::Stop)
            .hold(Guarded.state([0.0], [speed]), 0.0)
            .expect("a loop")
    };
    // On its way up, and on its way down, on which it falls below the limit within the step.
    for (speed, below) in [(0.5, 0.05), (-0.5, 0.05), (-0.5, 0.003)] {
        let mut run = hold(speed);
        run.set("limit", 2.0);
        for _ in 0..20 {
            run.advance().expect("a step");
        }
        let node = run.node().clone();
        run.set("limit", node.q[0] - below);
        run.advance().expect("a step");
        let end = run.node();
        assert_eq!((end.t, end.q), (node.t, node.q), "{speed}, {below}");
        assert!(matches!(run.advance(), Err(RunErrorKind::Ended { .. })));
    }
    let mut run = hold(0.5);
    let law = |node: &HeldNode<1>| match node.t < 0.15 {
        true => 2.0,
        false => node.q[0] - 0.05,
    };
    run.sample("limit", 0.1, law).expect("an input");
    for _ in 0..20 {
        run.advance().expect("a step");
    }
    let time = run.node().t;
    run.advance().expect("a step");
    assert_eq!(run.node().t, time);
    assert!(run.advance().is_err());
}

/// The outputs of the two nodes at an event that sets a parameter are those before and after it, with the inputs of
/// their step.
#[test]
fn outputs_of_a_loop_are_those_of_each_node() {
    #[dynamics(
        coordinates(x),
        lagrangian = dot(x)^2/2,
        input(u),
        force(x) = k*u,
        event(line) = x - 0.75,
        output(gain) = k,
        output(pushed) = u,
    )]
    struct Amplified {
        k: f64,
    }

    let mass = Amplified { k: 1.0 };
    let mut run = Simulation::new(&mass)
        .step(0.3)
        .on("line", Crossing::Rising, |_| {
            Act::Set(tfe::Settings::new("k", 2.0))
        })
        .hold(mass.state([0.0], [1.0]), 0.0)
        .expect("a loop");
    assert_eq!(run.node().output("gain"), Some(1.0));
    // Nodes at 0.3, 0.6, twice at 0.75, at 0.9 and 1.2; the input is set between those at 0.75.
    let gains = [1.0, 1.0, 1.0, 2.0, 2.0, 2.0];
    let inputs = [0.0, 0.0, 0.0, 0.0, 0.0, 5.0];
    for (number, (gain, input)) in gains.into_iter().zip(inputs).enumerate() {
        run.advance().expect("a step");
        let node = run.node();
        assert_eq!(node.output("gain"), Some(gain), "{node:?}");
        assert_eq!(node.output("pushed"), Some(input), "{node:?}");
        if number == 2 {
            assert!((node.t - 0.75).abs() < 1e-12, "{node:?}");
            run.set("u", 5.0);
        }
    }
}
