//! Trajectories compared with references of 32 digits: observed orders in q and in p, and the smallest errors.

use crate::common::{case, distance, larger, list, number, numbers, observed_order};
use crate::models::{DoublePendulum, EulerTop, HenonHeiles, Kepler, Pendulum, RigidBody};
use tfe::prelude::*;

/// One reference: the state (q, p) at a time.
struct Reference<const N: usize> {
    start: State<N>,
    end: State<N>,
    time: f64,
}

/// The state of the case `name` in the table at its `index`-th time; the table lists (q…, p…).
fn phase_reference<const N: usize>(name: &str, index: usize) -> Reference<N> {
    let case = case("trajectories", name);
    let state = |values: &[f64]| State {
        q: values[..N].try_into().expect("N coordinates"),
        p: values[N..].try_into().expect("N momenta"),
    };
    let at = &list(&case["states"])[index];
    Reference {
        start: state(&numbers(&case["initial"])),
        end: state(&numbers(&at["state"])),
        time: number(&at["t"]),
    }
}

fn run<M: Model<N>, const N: usize>(
    model: &M,
    (element, step): (Element, f64),
    start: State<N>,
    time: f64,
) -> Motion<N> {
    let simulation = Simulation::new(model).element(element).step(step);
    let motion = simulation.run(start, 0.0..time);
    motion.unwrap_or_else(|error| panic!("{element}, h = {step}: {error}"))
}

/// The larger errors in q and in p.
fn larger_errors(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [larger(one[0], other[0]), larger(one[1], other[1])]
}

/// The largest errors in q and p at the nodes of a run.
fn largest_errors<M: Model<N>, const N: usize>(
    model: &M,
    how: (Element, f64),
    exact: &Motion<N>,
) -> [f64; 2] {
    let start = exact.states()[0].state();
    let motion = run(model, how, start, exact.last().t);
    let off = motion.states().iter().map(|node| {
        let there = exact.at(node.t).expect("in the span");
        [distance(&node.q, &there.q), distance(&node.p, &there.p)]
    });
    off.fold([0.0; 2], larger_errors)
}

/// The observed order of the largest error at all nodes. At a single time, an error that happens to change its sign
/// there could show any order. Some elements have one order more on some models, which is allowed up to 1.2.
#[track_caller]
fn assert_order<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    exact: &Motion<N>,
    steps: &[f64],
    slack: f64,
) {
    let of_step = |&step: &f64| largest_errors(model, (element, step), exact);
    let worst: Vec<_> = steps.iter().map(of_step).collect();
    let claimed = element.order() as f64;
    // With five and six nodes there are few step sizes between those where the error is not yet asymptotic and
    // rounding. The elements are symmetric and their orders even: a slope within one of the expected order
    // distinguishes it from its neighbours.
    let slack = if element.nodes() >= 5 { 0.95 } else { slack };
    for (which, what) in ["q", "p"].into_iter().enumerate() {
        let errors = worst.iter().map(|worst| worst[which]);
        let points: Vec<(f64, f64)> = steps.iter().copied().zip(errors).collect();
        // Rounding errors are about 1e-15 for the pendulum and 1e-14 for the others.
        let order = observed_order(&points, 2e-14, &format!("{element}, {what}"));
        assert!(
            order > claimed - slack && order < claimed + 1.2,
            "{element}: order {order:.2} in {what}, claimed {claimed}: {points:?}"
        );
    }
}

/// Step sizes for 2 to 6 nodes, as fractions of `unit` (`six` for six nodes), for which the error falls towards
/// rounding.
fn steps(nodes: usize, unit: f64, six: &[f64]) -> Vec<f64> {
    let divisors: &[f64] = match nodes {
        2 => &[40.0, 80.0, 160.0, 320.0],
        3 => &[10.0, 20.0, 40.0, 80.0],
        4 => &[8.0, 12.0, 16.0, 24.0],
        5 => &[4.0, 5.0, 6.0, 8.0],
        _ => six,
    };
    divisors.iter().map(|divisor| unit / divisor).collect()
}

/// A motion that ends at the reference: errors are taken at many times, so that none is small by chance.
fn motion_to<M: Model<N>, const N: usize>(model: &M, reference: Reference<N>) -> Motion<N> {
    let how = (Mixed::<12>.into(), reference.time / 200.0);
    let motion = run(model, how, reference.start, reference.time);
    let (end, known) = (motion.last(), reference.end);
    assert!(distance(&end.q, &known.q) < 2e-14 && distance(&end.p, &known.p) < 1e-13);
    motion
}

fn families(nodes: usize) -> Vec<Element> {
    vec![
        Element::mixed(nodes),
        Element::primal(nodes),
        Element::primal(nodes).reduced(),
        Element::primal(nodes).lobatto(),
        Element::mixed(nodes).quadrature(nodes + 1),
        Element::energy_conserving(nodes),
    ]
}

#[test]
fn orders_two_to_ten_on_the_pendulum() {
    let exact = motion_to(&Pendulum { k: 1.0 }, phase_reference("pendulum_unit", 1));
    for nodes in 2..=6 {
        for element in families(nodes) {
            assert_order(
                &Pendulum { k: 1.0 },
                element,
                &exact,
                &steps(nodes, 1.0, &[2.5, 3.0, 3.5, 4.0]),
                0.35,
            );
        }
    }
}

#[test]
fn orders_two_to_ten_on_henon_heiles() {
    let exact = motion_to(
        &HenonHeiles { lambda: 1.0 },
        phase_reference("henon_heiles_E1_8", 0),
    );
    for nodes in 2..=6 {
        for element in families(nodes) {
            assert_order(
                &HenonHeiles { lambda: 1.0 },
                element,
                &exact,
                &steps(nodes, 1.0, &[2.0, 2.25, 2.5, 3.0, 3.5]),
                0.4,
            );
        }
    }
}

#[test]
fn orders_two_to_eight_on_the_double_pendulum() {
    let exact = motion_to(&DoublePendulum::UNIT, phase_reference("double_pendulum", 0));
    // A chaotic motion: for the steps where six nodes have errors above rounding, the error is not yet asymptotic.
    for nodes in 2..=5 {
        for element in families(nodes) {
            assert_order(
                &DoublePendulum::UNIT,
                element,
                &exact,
                &steps(nodes, 0.08, &[]),
                0.5,
            );
        }
    }
}

#[test]
fn orders_two_to_ten_on_kepler() {
    let exact = motion_to(&Kepler {}, phase_reference("kepler_e0.6", 1));
    for nodes in 2..=6 {
        for element in families(nodes) {
            assert_order(
                &Kepler {},
                element,
                &exact,
                &steps(nodes, 0.4, &[4.0, 5.0, 6.0, 8.0]),
                0.5,
            );
        }
    }
}

#[test]
fn radau_has_order_two_s_minus_one() {
    let exact = motion_to(&Pendulum { k: 1.0 }, phase_reference("pendulum_unit", 1));
    for (nodes, steps) in [
        (2, vec![0.004, 0.002, 0.001, 0.0005]),
        (3, vec![0.1, 0.05, 0.025, 0.0125]),
        (4, vec![0.2, 0.1, 0.05, 0.025]),
        (5, vec![0.4, 0.25, 0.2, 0.125]),
    ] {
        assert_order(
            &Pendulum { k: 1.0 },
            Element::radau(nodes),
            &exact,
            &steps,
            0.35,
        );
    }
}

/// The smallest error over the given steps, of q and p together.
#[track_caller]
fn assert_best<M: Model<N>, const N: usize>(
    model: &M,
    element: Element,
    reference: &Reference<N>,
    steps: &[f64],
    tolerance: f64,
) {
    let of_step = |&step: &f64| {
        let motion = run(model, (element, step), reference.start, reference.time);
        let (node, end) = (motion.last(), &reference.end);
        [distance(&node.q, &end.q), distance(&node.p, &end.p)]
    };
    let errors: Vec<_> = steps.iter().map(of_step).collect();
    assert!(
        errors.iter().any(|[q, p]| larger(*q, *p) <= tolerance),
        "{element}: errors in q and p {errors:?}"
    );
}

#[test]
fn best_errors() {
    let mixed = Element::mixed(8);
    for index in 0..3 {
        // Conditioning: the error of the initial state and the rounding errors of each step grow with t; 1e-12 up to t
        // = 20, 50.
        assert_best(
            &Kepler {},
            mixed,
            &phase_reference("kepler_e0.6", index),
            &[0.1, 0.05],
            1e-12,
        );
        assert_best(
            &Pendulum { k: 1.0 },
            mixed,
            &phase_reference("pendulum_unit", index),
            &[0.5, 0.25],
            1e-12,
        );
        assert_best(
            &HenonHeiles { lambda: 1.0 },
            mixed,
            &phase_reference("henon_heiles_E1_8", index),
            &[0.5, 0.25],
            1e-12,
        );
    }
    for index in 0..2 {
        assert_best(
            &Pendulum { k: 9.81 },
            mixed,
            &phase_reference("pendulum_9.81", index),
            &[0.1, 0.05],
            1e-12,
        );
    }
    // A chaotic motion: the exact flow amplifies a rounding error by 30 until t = 3 and by 1e3 until t = 5.
    for (index, tolerance) in [(0, 1e-13), (1, 1e-12), (2, 1e-11)] {
        assert_best(
            &DoublePendulum::UNIT,
            mixed,
            &phase_reference("double_pendulum", index),
            &[0.02, 0.01],
            tolerance,
        );
    }
}

/// Body rates and attitude of a rigid body at the times of the table.
fn check_body(name: &str, body: &RigidBody, element: Element, step: f64, tolerance: f64) {
    let case = case("trajectories", name);
    let initial = numbers(&case["initial"]);
    let start = body.moving(
        initial[3..].try_into().expect("a quaternion"),
        initial[..3].try_into().expect("three rates"),
    );
    for at in list(&case["states"]) {
        let time = number(&at["t"]);
        let motion = Simulation::new(body)
            .element(element)
            .step(step)
            .run(start, 0.0..time)
            .expect("the body moves");
        let rates = motion
            .outputs()
            .row(motion.states().len() - 1)
            .expect("outputs at the last node")
            .to_vec();
        let actual: Vec<f64> = rates.into_iter().chain(motion.last().q).collect();
        let error = distance(&actual, &numbers(&at["state"]));
        assert!(
            error <= tolerance,
            "{element} at t = {time}: error {error:.1e}"
        );
    }
}

#[test]
fn the_free_rigid_body() {
    let body = RigidBody {
        i1: 1.0,
        i2: 2.0,
        i3: 3.0,
        mgd: 0.0,
    };
    check_body("euler_rigid_body", &body, Element::mixed(6), 0.1, 1e-12);
    check_body(
        "euler_rigid_body",
        &body,
        Element::energy_conserving(6),
        0.1,
        1e-12,
    );
}

#[test]
fn the_heavy_top_in_quaternions() {
    let body = RigidBody {
        i1: 1.0,
        i2: 1.0,
        i3: 0.5,
        mgd: 1.0,
    };
    check_body("heavy_top", &body, Element::mixed(7), 0.05, 1e-11);
}

#[test]
fn the_heavy_top_in_euler_angles() {
    let case = case("trajectories", "heavy_top");
    let top = EulerTop {
        jt: 1.0,
        ja: 0.5,
        mgd: 1.0,
    };
    let start = top.state([0.0, 0.5, 0.0], [0.0, 0.0, 6.0]);
    for at in list(&case["states"]) {
        // (φ, θ, ψ, p_θ, p_φ, p_ψ)
        let e = numbers(&at["euler"]);
        let expected = [e[0], e[1], e[2], e[4], e[3], e[5]];
        for element in [Element::mixed(7), Element::primal(7)] {
            let motion = Simulation::new(&top)
                .element(element)
                .step(0.05)
                .run(start, 0.0..number(&at["t"]))
                .expect("the top spins");
            let end = motion.last();
            let actual: Vec<f64> = end.q.into_iter().chain(end.p).collect();
            let error = distance(&actual, &expected);
            assert!(
                error < 1e-11,
                "{element} at t = {}: error {error:.1e}",
                end.t
            );
        }
    }
}
