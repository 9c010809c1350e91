//! Inputs: functions of the time, tables, loops of control.

use tfe::prelude::*;
use tfe::{Driven, HeldNode, InputError, RunErrorKind};

/// A pendulum whose pivot is moved and whose axis is turned: inputs in the energy, in forces, in outputs.
#[dynamics(
    coordinates(theta),
    let vx = l*dot(theta)*cos(theta) + w,
    let vy = l*dot(theta)*sin(theta),
    lagrangian = m/2*(vx^2 + vy^2) + m*g*l*cos(theta),
    input(w, u),
    force(theta) = u - c*dot(theta),
    output(torque) = u - c*dot(theta),
    sensitivity(g),
)]
struct Driving {
    m: f64,
    l: f64,
    g: f64,
    c: f64,
}

/// The same with the motions written as formulas of t.
#[dynamics(
    coordinates(theta),
    let w = 0.3*cos(2*t),
    let u = 0.1*sin(t)*exp(-t/10),
    let vx = l*dot(theta)*cos(theta) + w,
    let vy = l*dot(theta)*sin(theta),
    lagrangian = m/2*(vx^2 + vy^2) + m*g*l*cos(theta),
    force(theta) = u - c*dot(theta),
    output(torque) = u - c*dot(theta),
    sensitivity(g),
)]
struct Written {
    m: f64,
    l: f64,
    g: f64,
    c: f64,
}

/// A Hamiltonian with an input in both of its halves.
#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2*y - y^3/3 + e*(x*px - y*py),
    input(e, f),
    force(x) = f*px,
)]
struct Kicked;

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    let e = 0.01*sin(3*t),
    hamiltonian = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2*y - y^3/3 + e*(x*px - y*py),
    force(x) = -0.1*cos(t)*px,
)]
struct KickedWritten;

/// A bead on a sphere, pushed.
#[dynamics(
    coordinates(r[3]),
    lagrangian = m/2*inner(dot(r), dot(r)) - m*g*r[2],
    constraint(sphere) = inner(r, r) - 1,
    input(push),
    force(r[0]) = push,
)]
struct Bead {
    m: f64,
    g: f64,
}

#[dynamics(
    coordinates(r[3]),
    lagrangian = m/2*inner(dot(r), dot(r)) - m*g*r[2],
    constraint(sphere) = inner(r, r) - 1,
    force(r[0]) = cos(5*t),
)]
struct BeadWritten {
    m: f64,
    g: f64,
}

const DRIVING: Driving = Driving {
    m: 1.3,
    l: 0.7,
    g: 9.81,
    c: 0.05,
};
const WRITTEN: Written = Written {
    m: 1.3,
    l: 0.7,
    g: 9.81,
    c: 0.05,
};

fn elements() -> [Element; 6] {
    [
        Mixed::<4>.into(),
        Mixed::<2>.into(),
        Mixed::<7>.into(),
        Primal::<3>.into(),
        Radau::<3>.into(),
        EnergyConserving::<4>.into(),
    ]
}

fn w(t: f64) -> f64 {
    0.3 * (2.0 * t).cos()
}

fn u(t: f64) -> f64 {
    0.1 * t.sin() * (-t / 10.0).exp()
}

/// A function given at run time is the same as one that is written in the declaration, in runs of every kind.
#[test]
fn an_input_is_what_a_formula_of_time_is() {
    let start = WRITTEN.state([1.0], [0.5]);
    for element in elements() {
        let given = Simulation::new(&DRIVING)
            .element(element)
            .step(0.05)
            .input("u", u)
            .input("w", w);
        let written = Simulation::new(&WRITTEN).element(element).step(0.05);
        let (a, b) = (
            given.run(start, 0.0..20.0).unwrap(),
            written.run(start, 0.0..20.0).unwrap(),
        );
        assert_eq!(a.states().len(), b.states().len());
        for (a, b) in a.states().iter().zip(b.states()) {
            assert!(
                (a.q[0] - b.q[0]).abs() < 1e-12 && (a.v[0] - b.v[0]).abs() < 1e-12,
                "{element:?} at {}",
                a.t
            );
        }
        let (columns, others) = (
            a.outputs().column("torque").unwrap(),
            b.outputs().column("torque").unwrap(),
        );
        assert!(
            columns
                .iter()
                .zip(&others)
                .all(|(a, b)| (a - b).abs() < 1e-12)
        );
        assert_eq!(a.warnings().len(), b.warnings().len());
        let (a, b) = (
            given.run_linearised(start, 0.0..5.0).unwrap(),
            written.run_linearised(start, 0.0..5.0).unwrap(),
        );
        assert!((a.product() - b.product()).norm() < 1e-10);
        for (a, b) in given
            .steps(start, 0.0)
            .zip(written.steps(start, 0.0))
            .take(50)
        {
            assert!((a.unwrap().q[0] - b.unwrap().q[0]).abs() < 1e-13);
        }
    }
    let given = Simulation::new(&DRIVING)
        .input("u", u)
        .input("w", w)
        .accuracy(1e-9);
    let written = Simulation::new(&WRITTEN).accuracy(1e-9);
    let (a, b) = (
        given.run(start, 0.0..20.0).unwrap(),
        written.run(start, 0.0..20.0).unwrap(),
    );
    assert!((a.last().q[0] - b.last().q[0]).abs() < 1e-8);
    assert!(a.error_estimate() < 1e-9);
}

/// Points side by side in the registers of the processor, Newton's method, models declared by a Hamiltonian.
#[test]
fn inputs_of_hamiltonian_models_are_the_same() {
    let start = State {
        q: [0.1, -0.05],
        p: [0.2, 0.3],
    };
    for element in elements() {
        for solver in [Solve::Auto, Solve::Newton] {
            let given = Simulation::new(&Kicked)
                .element(element)
                .step(0.1)
                .solver(solver)
                .input("e", |t| 0.01 * (3.0 * t).sin())
                .input("f", |t| -0.1 * t.cos());
            let written = Simulation::new(&KickedWritten)
                .element(element)
                .step(0.1)
                .solver(solver);
            let (a, b) = (
                given.run(start, 0.0..10.0).unwrap(),
                written.run(start, 0.0..10.0).unwrap(),
            );
            for k in 0..2 {
                assert!((a.last().q[k] - b.last().q[k]).abs() < 1e-12, "{element:?}");
                assert!((a.last().p[k] - b.last().p[k]).abs() < 1e-12, "{element:?}");
            }
        }
    }
}

#[test]
fn inputs_push_models_with_constraints() {
    let (bead, written) = (Bead { m: 0.5, g: 9.81 }, BeadWritten { m: 0.5, g: 9.81 });
    let start = bead.state([0.6, 0.0, -0.8], [0.0, 1.0, 0.0]);
    let simulation = Simulation::new(&bead)
        .step(0.01)
        .input("push", |t| (5.0 * t).cos());
    let a = simulation.run(start, 0.0..3.0).unwrap();
    let b = Simulation::new(&written)
        .step(0.01)
        .run(start, 0.0..3.0)
        .unwrap();
    for k in 0..3 {
        assert!((a.last().q[k] - b.last().q[k]).abs() < 1e-12);
    }
}

/// As a model the struct has all inputs zero, and so has a run in which some are not given.
#[test]
fn what_is_not_given_is_zero() {
    let start = DRIVING.state([1.0], [0.0]);
    let plain = Simulation::new(&DRIVING)
        .step(0.05)
        .run(start, 0.0..5.0)
        .unwrap();
    let zeros = Simulation::new(&DRIVING)
        .step(0.05)
        .input("u", |_| 0.0)
        .run(start, 0.0..5.0)
        .unwrap();
    assert_eq!(plain.states(), zeros.states());
}

/// A driven model is a model: ensembles and orbits take it.
#[test]
fn driven_models_are_models() {
    let driven = Driven::new(&DRIVING)
        .input("u", u)
        .unwrap()
        .input("w", w)
        .unwrap();
    let start = DRIVING.state([1.0], [0.0]);
    let alone = Simulation::new(&driven)
        .step(0.05)
        .run(start, 0.0..5.0)
        .unwrap();
    let nodes = Ensemble::new(&driven)
        .step(0.05)
        .run(&[start; 9], 0.0..5.0)
        .unwrap();
    for node in &nodes {
        let node = node.as_ref().unwrap();
        assert!((node.q[0] - alone.last().q[0]).abs() < 1e-12);
    }
    // The answer to a drive of period 2π/3.
    let damped = Driving { c: 0.8, ..DRIVING };
    let turned = Driven::new(&damped)
        .input("u", |t| (3.0 * t).sin())
        .unwrap();
    let period = 2.0 * std::f64::consts::PI / 3.0;
    let orbit = PeriodicOrbit::of(&turned).period(period).solve().unwrap();
    let node = orbit.start();
    let after = Simulation::new(&turned)
        .step(period / 400.0)
        .run(node, 0.0..period)
        .unwrap();
    assert!((after.last().q[0] - node.q[0]).abs() < 1e-9);
}

/// Elements end at the times of a table: a spline of its own knots costs no order, and a jump no digits.
#[test]
fn elements_end_at_the_times_of_a_table() {
    // θ″ = u exactly where the pendulum has no weight.
    let free = Driving {
        m: 1.0,
        l: 1.0,
        g: 0.0,
        c: 0.0,
    };
    let start = free.state([0.0], [0.0]);
    let times = [0.0, 0.7, 1.1, 2.03];
    let run = |values: [f64; 4], way| {
        let simulation = Simulation::new(&free)
            .step(0.25)
            .table("u", times, values, way);
        let motion = simulation.run(start, 0.0..3.0).unwrap();
        assert!(
            times
                .iter()
                .all(|time| motion.states().iter().any(|node| node.t == *time))
        );
        (motion.last().v[0], motion.last().q[0])
    };
    // ∫u and ∫(3 − t)u dt by hand.
    let (v, _) = run([1.0, -2.0, 0.5, 0.0], Interpolation::Hold);
    assert!((v - (0.7 - 0.8 + 0.465)).abs() < 1e-14, "{v}");
    let (v, _) = run([1.0, -2.0, 0.5, 0.0], Interpolation::Linear);
    assert!((v - (-0.35 - 0.3 + 0.2325)).abs() < 1e-14, "{v}");
    // A cubic on four points is itself: u = t³ up to 2.03, then kept.
    let (v, q) = run(times.map(|t| t.powi(3)), Interpolation::Spline);
    let (end, kept) = (times[3], times[3].powi(3));
    let rest = 3.0 - end;
    assert!((v - (end.powi(4) / 4.0 + kept * rest)).abs() < 1e-13);
    let exact = end.powi(5) / 20.0 + end.powi(4) / 4.0 * rest + kept * rest * rest / 2.0;
    assert!((q - exact).abs() < 1e-13);
}

/// A loop of control gives what a table of the same values gives.
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

#[test]
fn misuse_is_told() {
    let start = DRIVING.state([1.0], [0.0]);
    let unknown = Simulation::new(&DRIVING)
        .input("torque", |_| 1.0)
        .run(start, 0.0..1.0)
        .unwrap_err();
    let InputError::Unknown { name, known } = (match unknown.kind() {
        RunErrorKind::Input(error) => error.clone(),
        other => panic!("{other}"),
    }) else {
        panic!("{unknown}");
    };
    assert_eq!((name.as_str(), &known[..]), ("torque", &["w", "u"][..]));
    assert_eq!(
        unknown.to_string(),
        "the model has no input `torque`, only `w`, `u`"
    );
    let table = |times: &[f64], values: &[f64]| {
        let run = Simulation::new(&DRIVING).table("u", times, values, Interpolation::Spline);
        run.steps(start, 0.0)
            .next()
            .unwrap()
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        table(&[0.0, 1.0], &[1.0]),
        "the table of input `u`: there must be as many values as times, and at least one"
    );
    assert_eq!(
        table(&[0.0, 0.0], &[1.0, 2.0]),
        "the table of input `u`: the times must increase"
    );
    // Without a number there is no state, and an error says where and which input it was.
    let nan = Simulation::new(&DRIVING)
        .step(0.1)
        .input("u", |t| if t < 0.5 { 0.0 } else { f64::NAN });
    let error = nan.run(start, 0.0..1.0).unwrap_err();
    let RunErrorKind::Input(InputError::Value { name, time, value }) = error.kind() else {
        panic!("{error}");
    };
    assert!(name == "u" && (0.5..0.6).contains(time) && value.is_nan());
    assert!(error.partial().last().q[0].is_finite());
    let mut run = Simulation::new(&DRIVING)
        .step(0.1)
        .hold(start, 0.0)
        .unwrap();
    run.set("u", f64::NAN);
    assert_eq!(
        run.advance().unwrap_err().to_string(),
        "input `u` was set to NaN"
    );
    run.set("v", 1.0);
    assert!(matches!(
        run.advance(),
        Err(RunErrorKind::Input(InputError::Unknown { .. }))
    ));
    run.advance().unwrap();
    assert_eq!(run.node().t, 0.1);
    assert!(matches!(
        Simulation::new(&DRIVING).hold(start, 0.0),
        Err(RunErrorKind::Step { .. })
    ));
}

/// Events see inputs.
#[test]
fn events_of_inputs_are_met() {
    #[dynamics(coordinates(y), lagrangian = dot(y)^2/2 - g*y, input(floor), event(hit) = y - floor)]
    struct Ball {
        g: f64,
    }
    let ball = Ball { g: 10.0 };
    let motion = Simulation::new(&ball)
        .step(0.03)
        .on("hit", Crossing::Falling, |_| Act::Stop)
        .input("floor", |t| 0.1 * t)
        .run(ball.state([1.0], [0.0]), 0.0..1.0)
        .unwrap();
    // 1 − 5t² = 0.1 t
    let exact = (-0.1 + (0.01_f64 + 20.0).sqrt()) / 10.0;
    assert!((motion.events()[0].t - exact).abs() < 1e-14);
}

/// A function that panics, or gives what is no number, ends a run with an error that says when; what was recorded before is kept.
#[test]
fn functions_that_fail_are_told() {
    #[dynamics(coordinates(x), lagrangian = (dot(x)^2 - x^2)/2, input(u), force(x) = u, output(force) = u, event(middle) = x)]
    struct Oscillator;

    let start = Oscillator.state([1.0], [0.0]);
    let simulation = Simulation::new(&Oscillator).step(0.1);
    let nan = |t: f64| if t > 2.0 { f64::NAN } else { 0.1 };
    let panics = |t: f64| {
        assert!(t < 2.0, "no wind beyond two seconds");
        0.1
    };
    let is_value = |kind: &RunErrorKind| match kind {
        RunErrorKind::Input(InputError::Value { name, time, value }) => {
            name == "u" && (2.0..2.1).contains(time) && value.is_nan()
        }
        _ => false,
    };
    let is_panic = |kind: &RunErrorKind| match kind {
        RunErrorKind::Input(InputError::Panicked { time }) => (1.89..2.01).contains(time),
        _ => false,
    };
    let error = simulation
        .clone()
        .input("u", nan)
        .run(start, 0.0..5.0)
        .expect_err("NaN");
    assert!(is_value(error.kind()), "{error}");
    assert!((error.partial().last().t - 2.0).abs() < 1e-12);
    let error = simulation
        .clone()
        .input("u", panics)
        .run(start, 0.0..5.0)
        .expect_err("a panic");
    assert!(is_panic(error.kind()), "{error}");
    assert!(error.partial().states().len() >= 19);
    // At the very start.
    let at_once = |_: f64| -> f64 { panic!("at once") };
    let error = simulation
        .clone()
        .input("u", at_once)
        .run(start, 1.0..5.0)
        .expect_err("a panic");
    assert_eq!(
        error.kind(),
        &RunErrorKind::Input(InputError::Panicked { time: 1.0 })
    );
    let mut steps = simulation.clone().input("u", at_once).steps(start, 1.0);
    assert!(steps.next().is_some_and(|step| step.is_err()) && steps.next().is_none());
    // Step by step, with an accuracy, and where events are looked for.
    let mut steps = simulation.clone().input("u", panics).steps(start, 0.0);
    let error = steps.find_map(Result::err).expect("it ends");
    assert!(is_panic(&error) && steps.next().is_none());
    let mut steps = simulation.clone().input("u", nan).steps(start, 0.0);
    assert!(is_value(&steps.find_map(Result::err).expect("it ends")));
    let accurate = simulation
        .clone()
        .input("u", nan)
        .accuracy(1e-6)
        .run(start, 0.0..5.0);
    let error = accurate.expect_err("NaN");
    assert!(
        matches!(error.kind(), RunErrorKind::Input(InputError::Value { .. })),
        "{error}"
    );
    let watched = simulation
        .clone()
        .input("u", panics)
        .on("middle", Crossing::Either, |_| Act::Record)
        .run(start, 0.0..5.0)
        .expect_err("a panic");
    assert!(is_panic(watched.kind()) && watched.partial().events().len() == 1);
    // What failed once does not spoil another run.
    let good = simulation.clone().input("u", nan).run(start, 0.0..1.9);
    assert_eq!(good.expect("before it fails").states().len(), 20);
}

/// Feedback with rates of their own: the same as setting the inputs by hand at these times.
#[test]
fn feedback_is_sampled_with_its_own_rate() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2, input(u, w), force(x) = u + w)]
    struct Mass;

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
    assert!(hold().sample("v", 0.1, |_| 0.0).is_err());
    let mut between = hold();
    between
        .sample("u", 0.05, |_| 0.0)
        .expect("a positive period");
    let mut results = (0..3).map(|_| between.advance());
    assert!(results.next().is_some_and(|first| first.is_ok()));
    assert!(results.any(|one| one.is_err()) || told(between.advance()));
}

/// Parameters of a driven model are set as those of any other, and its inputs stay.
#[test]
fn parameters_of_driven_models_are_set() {
    let start = DRIVING.state([1.0], [0.0]);
    let heavier = |event: &tfe::Occurrence<'_, 1>| {
        assert!(event.parameter("m").is_some());
        Act::Set(tfe::Settings::new("m", 2.6).and("c", 0.1))
    };
    let run = |end: f64| {
        Simulation::new(&DRIVING)
            .step(0.05)
            .input("w", w)
            .input("u", u)
            .on_function("late", Crossing::Rising, |t, _, _| t - 1.0, heavier)
            .run(start, 0.0..end)
            .expect("a run")
    };
    let motion = run(3.0);
    let written = Simulation::new(&WRITTEN).step(0.05);
    let first = written.run(start, 0.0..1.0).expect("a run");
    let other = Written {
        m: 2.6,
        c: 0.1,
        ..WRITTEN
    };
    let second = Simulation::new(&other)
        .step(0.05)
        .run(first.last().state(), 1.0..3.0)
        .expect("a run");
    assert!((motion.last().q[0] - second.last().q[0]).abs() < 1e-12);
    assert!(
        (motion
            .outputs()
            .row(motion.states().len() - 1)
            .expect("a row")[0]
            - second.outputs().row(40).expect("a row")[0])
            .abs()
            < 1e-12
    );
}

/// A function that panics at the very start of a run that is to meet an accuracy, that is estimated, or that goes on, is told as in any other.
#[test]
fn functions_that_panic_at_once_are_told() {
    #[dynamics(coordinates(x), lagrangian = (dot(x)^2 - x^2)/2, input(u), force(x) = u, output(force) = u)]
    struct Oscillator;

    let start = Oscillator.state([1.0], [0.0]);
    let simulation = Simulation::new(&Oscillator).step(0.1);
    let panics = |_: f64| -> f64 { panic!("at once") };
    let broken = simulation.clone().input("u", panics);
    let check = |kind: &RunErrorKind| {
        let told = RunErrorKind::Input(InputError::Panicked { time: 1.0 });
        assert_eq!(kind, &told);
    };
    let accurate = broken.clone().accuracy(1e-6).run(start, 1.0..5.0);
    check(accurate.expect_err("a panic").kind());
    let estimated = broken.run_estimated(start, 1.0..5.0);
    check(estimated.expect_err("a panic").kind());
    let good = simulation.input("u", |_| 0.0).run(start, 0.0..1.0);
    let good = good.expect("a run");
    let resumed = broken.resume(good.checkpoint().expect("complete"), 5.0);
    check(resumed.expect_err("a panic").kind());
}

/// An input that jumps at the last node pushes up to there as before.
#[test]
fn given_nodes_may_end_at_a_jump() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2, input(u), force(x) = u)]
    struct Mass;

    let motion = Simulation::new(&Mass)
        .element(Radau::<3>)
        .nodes([0.0, 0.5, 1.0])
        .table("u", [0.0, 1.0], [1.0, -1.0], Interpolation::Hold)
        .run(Mass.state([0.0], [0.0]), 0.0..1.0)
        .expect("a run");
    let speed = motion.last().v[0];
    assert!((speed - 1.0).abs() < 1e-12, "{speed}");
}

/// The outputs of a node at which an event stops the loop are those of this node.
#[test]
fn outputs_of_a_loop_that_is_stopped_are_those_of_its_end() {
    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2, input(u), force(x) = u, event(wall) = 0.75 - x, output(place) = x)]
    struct Mass;

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

/// Late times have roundings that are much of a short period.
#[test]
fn feedback_is_sampled_at_late_times() {
    use std::sync::atomic::{AtomicU32, Ordering};

    #[dynamics(coordinates(x), lagrangian = dot(x)^2/2, input(u), force(x) = u)]
    struct Mass;

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
