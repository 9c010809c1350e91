//! Inputs: functions of time, tables, control loops.

mod failures;
mod loops;
mod rates;
mod whole;

use tfe::prelude::*;
use tfe::{AtError, Driven};

/// A pendulum with a moved pivot and a driven axis: inputs in the energy, in forces, and in outputs.
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

/// A mass that two inputs push.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2, input(u, w), force(x) = u + w, event(wall) = 0.75 - x, output(place) = x)]
struct Mass;

/// A Hamiltonian with an input in its kinetic and in its potential energy.
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

/// A bead on a sphere with a driving force.
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

/// Without the inputs of the run an output has other values: that integral is an error, not a wrong number.
#[test]
fn integrals_of_outputs_need_the_inputs_of_the_run() {
    let start = WRITTEN.state([1.0], [0.5]);
    let driven = Driven::new(&DRIVING).input("u", u).unwrap();
    let driven = driven.input("w", w).unwrap();
    let given = Simulation::new(&DRIVING).step(0.05);
    let given = given.input("u", u).input("w", w);
    let written = Simulation::new(&WRITTEN).step(0.05);
    let (a, b) = (
        given.run(start, 0.0..5.0).unwrap(),
        written.run(start, 0.0..5.0).unwrap(),
    );
    let (a, b) = (
        a.integral(&driven, "torque").unwrap(),
        b.integral(&WRITTEN, "torque").unwrap(),
    );
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        // Other kernels with the same numbers, after a hundred steps.
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
    let motion = given.run(start, 0.0..5.0).unwrap();
    let told = motion.integral(&DRIVING, "torque").unwrap_err();
    assert!(matches!(told, AtError::OtherModel { .. }), "{told}");
    assert!(told.to_string().contains("`Driven`"), "{told}");
    // Other parameters are another model, too.
    let motion = written.run(start, 0.0..5.0).unwrap();
    let thick = Written { c: 0.06, ..WRITTEN };
    let told = motion.integral(&thick, "torque").unwrap_err();
    assert!(matches!(told, AtError::OtherModel { .. }), "{told}");
    // An output without inputs needs none.
    let pushed = Simulation::new(&Mass).step(0.1).input("u", |t| 2.0 * t);
    let motion = pushed.run(Mass.state([0.0], [0.0]), 0.0..2.0).unwrap();
    let place = motion.integral(&Mass, "place").unwrap();
    assert!((place[20] - 4.0 / 3.0).abs() < 1e-12); // x = t³/3
}

/// A function given at run time gives the same as one written in the declaration, in all kinds of runs.
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

/// With lanes of points, with Newton's method, and for Hamiltonians.
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

/// As a model, the struct has all inputs zero, and so has a run in which some inputs are not given.
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

/// A driven model is a model: ensembles and orbits accept it.
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
    // The response to a drive of period 2π/3.
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

/// Elements end at the times of a table: a spline does not reduce the order at its knots, nor a jump the accuracy.
#[test]
fn elements_end_at_the_times_of_a_table() {
    // θ″ = u exactly, since the pendulum has no weight.
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
        let driven = Driven::new(&free);
        let driven = driven.table("u", &times, &values, way).expect("a table");
        let same = Simulation::new(&driven).step(0.25).run(start, 0.0..3.0);
        assert_eq!(same.unwrap().states(), motion.states());
        let drivens = [driven, Driven::new(&free)];
        let ends = Ensemble::of_models(&drivens).step(0.25);
        let ends = ends.run(&[start], 0.0..3.0).unwrap();
        let end = ends.iter().next().unwrap().as_ref().unwrap();
        assert!((end.q[0] - motion.last().q[0]).abs() <= 1e-15);
        (motion.last().v[0], motion.last().q[0])
    };
    // ∫u and ∫(3 − t)u dt by hand.
    let (v, _) = run([1.0, -2.0, 0.5, 0.0], Interpolation::Hold);
    assert!((v - (0.7 - 0.8 + 0.465)).abs() < 1e-14, "{v}");
    let (v, _) = run([1.0, -2.0, 0.5, 0.0], Interpolation::Linear);
    assert!((v - (-0.35 - 0.3 + 0.2325)).abs() < 1e-14, "{v}");
    // A cubic spline through four points of a cubic is exact: u = t³ up to 2.03, then constant.
    let (v, q) = run(times.map(|t| t.powi(3)), Interpolation::Spline);
    let (end, kept) = (times[3], times[3].powi(3));
    let rest = 3.0 - end;
    assert!((v - (end.powi(4) / 4.0 + kept * rest)).abs() < 1e-13);
    let exact = end.powi(5) / 20.0 + end.powi(4) / 4.0 * rest + kept * rest * rest / 2.0;
    assert!((q - exact).abs() < 1e-13);
}

/// No time is left out at the times of a table: a mass that nothing pushes goes as far as its velocity says. All
/// numbers are sums of powers of two.
#[test]
fn many_times_of_a_table_cost_no_time() {
    for start in [0.0, 1e6, 1.7e9] {
        let times: Vec<f64> = (0..=1000)
            .map(|k| start + 0.015625 * f64::from(k))
            .collect();
        let simulation = Simulation::new(&Mass).step(0.25).table(
            "u",
            &times,
            vec![0.0; times.len()],
            Interpolation::Hold,
        );
        let begin = Mass.state([0.0], [1.0]);
        let motion = simulation.run(begin, start..start + 15.625).unwrap();
        assert_eq!(motion.last().q[0], 15.625, "from {start}");
        let steps = simulation.steps(begin, start).take(1000).last();
        assert_eq!(steps.unwrap().unwrap().q[0], 15.625, "from {start}");
        let accurate = simulation.accuracy(1e-9).run(begin, start..start + 15.625);
        let accurate = accurate.unwrap().last().q[0];
        assert!(
            (accurate - 15.625).abs() <= 1e-12,
            "from {start}: {accurate}"
        );
    }
}

/// Events depend on inputs.
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

/// Parameters of a driven model are set as those of any other, and its inputs are kept.
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

/// An input that jumps at the last node acts as before up to there.
#[test]
fn given_nodes_may_end_at_a_jump() {
    let motion = Simulation::new(&Mass)
        .element(Radau::<3>)
        .nodes([0.0, 0.5, 1.0])
        .table("u", [0.0, 1.0], [1.0, -1.0], Interpolation::Hold)
        .run(Mass.state([0.0], [0.0]), 0.0..1.0)
        .expect("a run");
    let speed = motion.last().v[0];
    assert!((speed - 1.0).abs() < 1e-12, "{speed}");
}

/// A run continued with another input starts with the velocity that belongs to its momentum with that input, p = m l (l
/// θ̇ + w cos θ); with an input of the same values the run is the same.
#[test]
fn runs_that_go_on_with_another_input_begin_with_its_velocity() {
    let run = Simulation::new(&DRIVING).step(0.1);
    let start = DRIVING.state([0.4], [0.7]);
    let whole = run.clone().input("w", w).run(start, 0.0..1.0).unwrap();
    let first = run.clone().input("w", w).run(start, 0.0..0.5).unwrap();
    let checkpoint = first.checkpoint().unwrap();
    let same = run.clone().input("w", w).resume(checkpoint, 1.0).unwrap();
    assert_eq!(same.states(), &whole.states()[5..]);
    let other = run.input("w", |t| w(t) + 0.2).resume(checkpoint, 1.0);
    let other = other.unwrap();
    let Driving { m, l, .. } = DRIVING;
    let node = &other.states()[0];
    let v = (node.p[0] / (m * l) - (w(0.5) + 0.2) * node.q[0].cos()) / l;
    assert!((node.v[0] - v).abs() < 1e-12, "{} for {v}", node.v[0]);
    assert_eq!(other.velocities()[0], node.v);
    // The rest is the motion from that state.
    let anew = Simulation::new(&DRIVING).step(0.1);
    let anew = anew.input("w", |t| w(t) + 0.2);
    let anew = anew.run(*checkpoint.state(), 0.5..1.0).unwrap();
    assert!((anew.last().q[0] - other.last().q[0]).abs() < 1e-12);
}
