//! Elements that are the same map, and known methods among them.

use crate::common::assert_close;
use crate::models::Everything;
use tfe::prelude::*;

fn end<M: Model<N>, const N: usize>(
    model: &M,
    element: impl Into<Element>,
    start: State<N>,
    h: f64,
    steps: u32,
) -> Vec<f64> {
    let element = element.into();
    let motion = Simulation::new(model)
        .element(element)
        .step(h)
        .run(start, 0.0..h * f64::from(steps))
        .unwrap_or_else(|error| panic!("{element}: {error}"));
    motion.last().q.into_iter().chain(motion.last().p).collect()
}

#[test]
fn mixed_and_primal_with_gauss_points_are_gauss_collocation() {
    let model = Everything { c: 0.3 };
    let start = model.state([0.4, 0.9], [0.5, -0.2]);
    for nodes in 2..=8 {
        let mixed = end(&model, Element::mixed(nodes), start, 0.1, 1);
        let primal = end(&model, Element::primal(nodes).reduced(), start, 0.1, 1);
        let collocation = gauss_collocation(nodes - 1, [0.4, 0.9, start.p[0], start.p[1]], 0.1);
        assert_close(&mixed, &primal, 1e-14, &format!("primal, {nodes} nodes"));
        assert_close(
            &mixed,
            &collocation,
            1e-14,
            &format!("collocation, {nodes} nodes"),
        );
    }
}

/// Gauss collocation of (q, p)˙ = (v, L_q + Q), written out by hand: nodes by Newton's method on the Legendre
/// polynomial, coefficients by integrating Lagrange polynomials, stages by fixed-point iteration. Nothing of it is
/// shared with the library.
fn gauss_collocation(stages: usize, y0: [f64; 4], h: f64) -> Vec<f64> {
    let nodes: Vec<f64> = (0..stages).map(|k| gauss_node(stages, k)).collect();
    let integral = |j: usize, to: f64| -> f64 {
        // Gauss quadrature of high order is exact for the Lagrange polynomials.
        (0..stages + 1)
            .map(|m| {
                let x = gauss_node(stages + 1, m);
                let tau = to * x;
                let lagrange: f64 = (0..stages)
                    .filter(|&i| i != j)
                    .map(|i| (tau - nodes[i]) / (nodes[j] - nodes[i]))
                    .product();
                to * gauss_weight(stages + 1, x) * lagrange
            })
            .sum()
    };
    let a: Vec<Vec<f64>> = nodes
        .iter()
        .map(|&c| (0..stages).map(|j| integral(j, c)).collect())
        .collect();
    let b: Vec<f64> = (0..stages).map(|j| integral(j, 1.0)).collect();
    let mut slopes = vec![[0.0; 4]; stages];
    for _ in 0..100 {
        slopes = (0..stages)
            .map(|i| {
                let mut y = y0;
                for (j, slope) in slopes.iter().enumerate() {
                    for (y, slope) in y.iter_mut().zip(slope) {
                        *y += h * a[i][j] * slope;
                    }
                }
                right_hand_side(nodes[i] * h, y)
            })
            .collect();
    }
    let mut y = y0;
    for (j, slope) in slopes.iter().enumerate() {
        for (y, slope) in y.iter_mut().zip(slope) {
            *y += h * b[j] * slope;
        }
    }
    y.to_vec()
}

/// ẏ of `Everything` with c = 0.3, derived by hand; y = (x, y, p_x, p_y).
fn right_hand_side(t: f64, [x, y, px, py]: [f64; 4]) -> [f64; 4] {
    let c = 0.3;
    let vx = px / (1.0 + x * x / 4.0);
    let vy = py - x * y / 3.0;
    let fx = x / 4.0 * vx * vx + vy * y / 3.0 - x.powi(3) - y / 3.0 - c * vx * (1.0 + y * y)
        + (2.0 * t).cos() / 4.0;
    let fy = x * vy / 3.0 + y.sin() * (1.0 + t.sin() / 5.0) - x / 3.0 - 2.0 * c / 3.0 * vy;
    [vx, vy, fx, fy]
}

fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut here) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, here) = (here, ((2.0 * k - 1.0) * x * here - (k - 1.0) * before) / k);
    }
    (here, n as f64 * (x * here - before) / (x * x - 1.0))
}

fn gauss_node(n: usize, k: usize) -> f64 {
    let mut x = -(std::f64::consts::PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
    for _ in 0..20 {
        let (value, slope) = legendre(n, x);
        x -= value / slope;
    }
    f64::midpoint(1.0, x)
}

fn gauss_weight(n: usize, node: f64) -> f64 {
    let x = 2.0 * node - 1.0;
    let (_, slope) = legendre(n, x);
    1.0 / ((1.0 - x * x) * slope * slope)
}

#[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - x^4/4 - x^2*y/2 - cos(y))]
struct Separable {
    m: f64,
}

#[test]
fn primal_with_two_lobatto_points_is_stoermer_verlet() {
    let model = Separable { m: 2.0 };
    let h = 0.1;
    let force = |q: [f64; 2]| [-q[0].powi(3) - q[0] * q[1], -q[0] * q[0] / 2.0 + q[1].sin()];
    let mut q = [0.7, -0.3];
    let mut p = [0.2, 0.5];
    let start = State { q, p };
    for _ in 0..20 {
        let f = force(q);
        for k in 0..2 {
            p[k] += h / 2.0 * f[k];
            q[k] += h * p[k] / 2.0;
        }
        let f = force(q);
        for k in 0..2 {
            p[k] += h / 2.0 * f[k];
        }
    }
    let actual = end(&model, Primal::<2>.lobatto(), start, h, 20);
    // The rounding errors of twenty steps.
    assert_close(&actual, &[q[0], q[1], p[0], p[1]], 1e-14, "Störmer–Verlet");
}

#[test]
fn two_node_mixed_is_the_midpoint_rule_and_energy_conserving_the_averaged_field() {
    let model = Separable { m: 2.0 };
    let start = State {
        q: [0.7, -0.3],
        p: [0.2, 0.5],
    };
    let h = 0.1;
    // Implicit midpoint, by fixed-point iteration.
    let force = |q: [f64; 2]| [-q[0].powi(3) - q[0] * q[1], -q[0] * q[0] / 2.0 + q[1].sin()];
    let mut end_state = start;
    for _ in 0..100 {
        let mid = |a: [f64; 2], b: [f64; 2]| [f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])];
        let (q, p) = (mid(start.q, end_state.q), mid(start.p, end_state.p));
        let f = force(q);
        for k in 0..2 {
            end_state.q[k] = start.q[k] + h * p[k] / 2.0;
            end_state.p[k] = start.p[k] + h * f[k];
        }
    }
    let expected: Vec<f64> = end_state.q.into_iter().chain(end_state.p).collect();
    assert_close(
        &end(&model, Mixed::<2>, start, h, 1),
        &expected,
        1e-15,
        "midpoint rule",
    );
    assert_close(
        &end(&model, EnergyConserving::<2>.quadrature(1), start, h, 1),
        &expected,
        1e-15,
        "one point",
    );
}

#[test]
fn a_step_back_undoes_a_step() {
    let model = Everything { c: 0.0 };
    let start = model.state([0.4, 0.9], [0.5, -0.2]);
    for element in [
        Element::mixed(4),
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::energy_conserving(3),
    ] {
        let simulation = Simulation::new(&model).element(element).step(0.05);
        let there = simulation
            .run(start, 0.0..1.0)
            .expect("forward")
            .last()
            .state();
        let back = simulation
            .run(there, 1.0..0.0)
            .expect("backward")
            .last()
            .state();
        assert_close(&back.q, &start.q, 1e-13, &format!("{element}: q"));
        assert_close(&back.p, &start.p, 1e-13, &format!("{element}: p"));
    }
}

#[test]
fn the_iterations_agree() {
    let model = Everything { c: 0.3 };
    let start = model.state([0.4, 0.9], [0.5, -0.2]);
    for element in [
        Element::mixed(4),
        Element::primal(3),
        Element::energy_conserving(3),
        Element::radau(4),
    ] {
        let run = |solve| {
            let motion = Simulation::new(&model)
                .element(element)
                .step(0.1)
                .solver(solve)
                .run(start, 0.0..2.0);
            motion
                .unwrap_or_else(|error| panic!("{element}, {solve:?}: {error}"))
                .last()
                .q
        };
        let newton = run(Solve::Newton);
        assert_close(
            &run(Solve::FixedPoint),
            &newton,
            1e-13,
            &format!("{element}: fixed point"),
        );
        assert_close(
            &run(Solve::Auto),
            &newton,
            1e-13,
            &format!("{element}: automatic"),
        );
    }
}
