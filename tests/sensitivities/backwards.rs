//! Gradients of losses by the adjoint (backward) method.

use super::*;
use crate::composed::{self, TIMES};

/// The backward gradient of a loss equals the one composed of forward derivatives.
#[track_caller]
fn check_gradient<M: Model<N> + Sync, const N: usize>(
    simulation: &Simulation<'_, M, N>,
    start: State<N>,
    output: &str,
) {
    let gradient = |loss: &Loss<'_, N>| {
        let found = simulation.gradient(start, 0.0..1.0, loss);
        found.expect("a gradient")
    };
    let all = gradient(&composed::of_all(output));
    let of_states = gradient(&composed::of_states(output));
    let forwards = TIMES
        .iter()
        .fold(simulation.clone(), |run, t| run.break_at(*t));
    let s = forwards.run_sensitive(start, 0.0..1.0);
    let s = s.expect("derivatives");
    let pairs = composed::pairs(&all, &of_states, &s, output);
    let [value, expected] = pairs.value;
    assert!((value - expected).abs() < 1e-13 * value.abs().max(1.0));
    let size = all.1.by_parameters().iter();
    let size = size.fold(1.0_f64, |m, x| m.max(x.abs()));
    for (name, [found, expected]) in s.parameters().iter().zip(&pairs.by_parameters) {
        assert!(
            (found - expected).abs() < 1e-12 * size,
            "{name}: {found} {expected}"
        );
    }
    for (a, [found, expected]) in pairs.by_start[N..].iter().enumerate() {
        assert!(
            (found - expected).abs() < 1e-12 * size.max(expected.abs()),
            "{a}: {found} {expected}"
        );
    }
}

#[test]
fn gradients_backwards_are_derivatives_forwards() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let elements: [Element; 5] = [
        Mixed::<4>.into(),
        Primal::<3>.into(),
        Primal::<4>.reduced(),
        Radau::<3>.into(),
        Element::primal(4).lobatto(),
    ];
    for element in elements {
        let simulation = Simulation::new(&PENDULUMS).element(element).step(0.05);
        check_gradient(&simulation, start, "height");
        check_gradient(&simulation.impulse(0.42, [0.1, -0.2]), start, "speed");
    }
    // With steps that are cut into pieces.
    let simulation = Simulation::new(&PENDULUMS).step(0.9).element(Mixed::<3>);
    check_gradient(&simulation, start, "speed");
    let start = PHASE;
    for element in [Mixed::<4>.into(), Element::primal(3)] {
        let simulation = Simulation::new(&DRIVEN).element(element).step(0.1);
        check_gradient(&simulation, start, "moment");
    }
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    let start = ball.state([0.6], [0.0]);
    check_gradient(&bouncing(&ball), start, "velocity");
    let start = ROD.state([0.6, -0.8], [0.4, 0.3]);
    check_gradient(&Simulation::new(&ROD).step(0.02), start, "height");
}

/// Times that differ only by the rounding errors of a long sum share a node, also with a break and with a given node.
#[test]
fn squares_at_times_a_few_roundings_apart() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let near = |roundings: f64| 0.5 * (1.0 + roundings * f64::EPSILON);
    let twice = Loss::squares("height", [near(20.0), near(40.0)], [0.3, 0.3]);
    let once = Loss::squares("height", [0.5], [0.3]).times(2.0);
    let run = Simulation::new(&PENDULUMS).step(0.05);
    let nodes: Vec<f64> = (0..=20).map(|k| 0.05 * f64::from(k)).collect();
    let with_nodes = run.clone().nodes(nodes);
    for run in [run.clone(), run.break_at(0.5), with_nodes] {
        let [twice, once] = [&twice, &once].map(|loss| gradient_of(&run, start, 0.0..1.0, loss));
        compare_rows(&twice, &once, "twice");
    }
}

/// A loss given as a function of slices, for models of any length, equals one of nodes.
#[test]
fn losses_of_slices_are_those_of_nodes() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let simulation = Simulation::new(&PENDULUMS).step(0.05);
    let of_node = Loss::at_end(|node: &Node<2>| node.q[0].sin() + node.p[1] * node.v[0]);
    let of_slices = Loss::of_end(|q, p, v| q[0].sin() + p[1] * v[0]);
    let (one, by_node) = simulation
        .gradient(start, 0.0..1.0, &of_node)
        .expect("a gradient");
    let (other, by_slices) = simulation
        .gradient(start, 0.0..1.0, &of_slices)
        .expect("a gradient");
    assert_eq!(one, other);
    assert_eq!(by_node.by_parameters(), by_slices.by_parameters());
    assert_eq!(by_node.by_start(), by_slices.by_start());
}

/// A row of masses, with friction between neighbours that depends on their positions, and springs that are all
/// different.
#[dynamics(
    coordinates(q[5]),
    lagrangian = sum(i in 0..5, m[i]/2*dot(q[i])^2 + b*q[i]*dot(q[i])^2/2) - sum(i in 0..4, k[i]/2*(q[i+1]-q[i])^2 + a[i]/4*(q[i+1]-q[i])^4) - k[4]/2*q[0]^2,
    dissipation = sum(i in 0..4, c[i]/2*(dot(q[i+1]) - dot(q[i]))^2),
    force(q[4]) = f*sin(omega*t),
    output(middle) = q[2]*k[1],
)]
struct Row {
    m: [f64; 5],
    k: [f64; 5],
    a: [f64; 4],
    c: [f64; 4],
    b: f64,
    f: f64,
    omega: f64,
}

const ROW: Row = Row {
    m: [1.0, 1.1, 0.9, 1.3, 0.8],
    k: [2.0, 1.5, 1.7, 2.2, 0.5],
    a: [0.3, 0.2, 0.4, 0.1],
    c: [0.05, 0.1, 0.02, 0.07],
    b: 0.1,
    f: 0.4,
    omega: 1.9,
};

/// Many parameters at once, with the operations traversed backwards: for steps solved by fixed-point iteration, and by
/// factors where steps are too long for it; for elements with fewer and with more points than there are lanes.
#[test]
fn gradients_by_many_parameters_are_derivatives_forwards() {
    let start = ROW.state([0.3, -0.2, 0.1, 0.4, -0.5], [0.1, 0.0, -0.3, 0.2, 0.4]);
    for (element, step) in [
        (Element::from(Mixed::<4>), 0.1),
        (Mixed::<3>.into(), 0.5),
        (Mixed::<7>.into(), 0.2),
        (Mixed::<10>.into(), 0.2),
        (Primal::<3>.into(), 0.1),
        (EnergyConserving::<3>.into(), 0.1),
    ] {
        let simulation = Simulation::new(&ROW).element(element).step(step);
        check_gradient(&simulation, start, "middle");
    }
}

/// A heavy body on a spring of its own, next to light ones on weak springs: its part of the gradient is smaller by its
/// mass, and must have as many digits.
#[test]
fn gradients_of_heavy_bodies_keep_their_digits() {
    let row = Row {
        m: [1e15, 1.0, 1.0, 1.0, 1.0],
        k: [1e-6, 1e-6, 1e-6, 1e-6, 1e15],
        a: [0.0; 4],
        c: [0.0; 4],
        b: 0.0,
        f: 0.0,
        ..ROW
    };
    let start = row.state([0.4, -0.2, 0.1, 0.4, -0.5], [0.3, 0.0, -0.3, 0.2, 0.4]);
    let simulation = Simulation::new(&row).element(Mixed::<4>).step(0.6);
    let loss = Loss::at_end(|node: &Node<5>| node.q[0] + node.q[4]);
    let gradient = simulation.gradient(start, 0.0..3.0, &loss);
    let (_, gradient) = gradient.expect("a gradient");
    let s = simulation
        .run_sensitive(start, 0.0..3.0)
        .expect("derivatives");
    let matrix = s.by_start().last();
    let (by_q, by_p) = (matrix.q_by_q(), matrix.q_by_p());
    let by = |name: &str| {
        let last = s.by(name).last();
        (gradient.by(name), last.q[0] + last.q[4])
    };
    let of_start = gradient.by_start();
    for (found, expected) in [
        by("k[4]"),
        by("m[0]"),
        by("k[3]"),
        (of_start.p[0], by_p[(0, 0)] + by_p[(4, 0)]),
        (of_start.q[0], by_q[(0, 0)] + by_q[(4, 0)]),
    ] {
        let off = (found / expected - 1.0).abs();
        assert!(off < 1e-9, "{found:e} {expected:e}: {off:e}");
    }
}

/// A selection of many parameters, in any order, has the same derivatives as among all.
#[test]
fn some_parameters_backwards_are_those_among_all() {
    let mut state = ROW.state([0.3, -0.2, 0.1, 0.4, -0.5], [0.1, 0.0, -0.3, 0.2, 0.4]);
    let mut stepper =
        Stepper::new(&ROW, Mixed::<5>.into(), Control::default()).expect("an element");
    stepper.advance(0.0, 0.2, &mut state, &[]).expect("a step");
    let lambda: [f64; 10] = std::array::from_fn(|row| 1.0 / (row + 1) as f64);
    let mut by = |indices: &[usize]| {
        let direction = |index: &usize| Direction {
            parameter: Some(Parameter::Any(*index)),
            ..Direction::default()
        };
        let directions: Vec<_> = indices.iter().map(direction).collect();
        let (mut rest, mut sums) = (lambda, vec![0.0; indices.len()]);
        let product = stepper.adjoint(&directions, &mut rest, &mut sums);
        product.expect("a derivative");
        (rest, sums)
    };
    let all: Vec<usize> = (0..ROW.parameters()).collect();
    let (by_start, by_all) = by(&all);
    assert!(by_all.iter().filter(|sum| **sum != 0.0).count() > 18);
    let some = [17, 3, 20, 0, 9];
    let (again, by_some) = by(&some);
    assert_eq!(again, by_start);
    assert_eq!(by_some, some.map(|index| by_all[index]));
}

#[test]
fn losses_that_are_none_are_told() {
    let simulation = Simulation::new(&PENDULUMS).step(0.05);
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let error = |loss: Loss<'_, 2>| {
        let error = simulation
            .gradient(start, 0.0..1.0, &loss)
            .expect_err("no gradient");
        error.kind().clone()
    };
    let unknown = error(Loss::output_at_end("hight"));
    assert!(unknown.to_string().contains("height"), "{unknown}");
    let undefined = error(Loss::at_end(|node| (-1.0 - node.q[0].abs()).sqrt()));
    assert!(
        matches!(undefined, RunErrorKind::Loss { .. }),
        "{undefined}"
    );
    assert!(undefined.to_string().contains("not finite"), "{undefined}");
    for (times, values) in [
        (vec![0.5], vec![]),
        (vec![1.5], vec![1.0]),
        (vec![f64::NAN], vec![1.0]),
        (vec![0.5], vec![f64::NAN]),
    ] {
        let kind = error(Loss::squares("height", times, values));
        assert!(matches!(kind, RunErrorKind::Loss { .. }), "{kind}");
    }
    let gradient = simulation.gradient(start, 0.0..1.0, &Loss::output_at_end("height"));
    let (_, gradient) = gradient.expect("a gradient");
    assert_eq!(
        (gradient.get("nothing"), gradient.parameters().len()),
        (None, 6)
    );
}

/// Nodes that are not stored are computed again during the backward sweep.
#[test]
fn gradients_of_runs_that_keep_some_nodes_are_those_of_runs_that_keep_all() {
    #[track_caller]
    fn compare<M: Model<N> + Sync, const N: usize>(
        simulation: &Simulation<'_, M, N>,
        start: State<N>,
        span: std::ops::Range<f64>,
        output: &str,
    ) {
        let loss = composed::of_span(output, &span);
        let all = gradient_of(simulation, start, span.clone(), &loss);
        for every in [2, 7, usize::MAX] {
            let some = simulation.clone().record_every(every);
            let some = gradient_of(&some, start, span.clone(), &loss);
            compare_rows(&some, &all, &format!("every {every}"));
        }
    }
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    for element in [Mixed::<4>.into(), Element::primal(3), Radau::<3>.into()] {
        let simulation = Simulation::new(&PENDULUMS).element(element).step(0.05);
        compare(&simulation, start, 0.0..1.0, "speed");
        let simulation = simulation.impulse(0.42, [0.1, -0.2]).break_at(0.77);
        compare(&simulation, start, 0.0..1.0, "height");
    }
    let simulation = Simulation::new(&PENDULUMS).step(0.05);
    compare(&simulation, start, 1.0..0.0, "speed");
    compare(&simulation, start, 0.5..0.5, "speed");
    compare(&simulation.solver(Solve::Newton), start, 0.0..1.0, "speed");
    let simulation = Simulation::new(&PENDULUMS).step(0.9).element(Mixed::<3>);
    compare(&simulation, start, 0.0..3.0, "speed");
    let start = ROD.state([0.6, -0.8], [0.4, 0.3]);
    compare(&Simulation::new(&ROD).step(0.02), start, 0.0..1.0, "height");
    let ball = Ball {
        m: 1.0,
        g: 9.81,
        floor: 0.0,
    };
    compare(
        &bouncing(&ball),
        ball.state([0.6], [0.0]),
        0.0..1.0,
        "velocity",
    );
}

/// With √n of n nodes stored, the memory grows as √n.
#[test]
fn nodes_that_are_not_kept_take_no_memory() {
    let start = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
    let loss = Loss::output_at_end("height");
    let most = |every: usize| {
        let simulation = Simulation::new(&PENDULUMS).step(0.01).record_every(every);
        let run = || {
            gradient_of(&simulation, start, 0.0..25.0, &loss);
        };
        allocation_counter::measure(run).bytes_max
    };
    let (all, some) = (most(1), most(50));
    assert!(10 * some < all, "{some} bytes beside {all}");
}
