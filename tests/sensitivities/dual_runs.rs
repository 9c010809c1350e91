//! Derivatives of whole runs compared with an independent solver in dual numbers, forward and backward.

mod constrained;
mod events;

use super::*;
use crate::duals::{self, Beside, Phase, number};

/// The effect of rounding errors in ten steps of both solvers, relative to the largest derivative.
const ROUNDING: f64 = 1e-12;

/// The largest difference relative to the largest derivative, for derivatives of the end of a run by all parameters and
/// by the initial state; then the backward gradient of a loss is compared with them.
fn off<M: Model<N> + Sync, const N: usize>(
    run: &Simulation<'_, M, N>,
    start: State<N>,
    length: f64,
    end: &dyn Fn(&Phase, Option<usize>) -> Phase,
) -> f64 {
    let s = run.run_sensitive(start, 0.0..length);
    let s = s.expect("derivatives");
    let mut beside = Beside::new((&start.q, &start.p), end);
    for (index, name) in s.parameters().iter().enumerate() {
        let found = s.by(name).last();
        beside.by_parameter(index, &found.q, &found.p);
    }
    let matrix = s.by_start().last();
    for column in 0..2 * N {
        let found: Vec<f64> = matrix.column(column).iter().copied().collect();
        beside.by_start(column, &found[N..], &found[..N]);
    }
    let weight = |a: usize| (1.0 + a as f64).sin();
    let loss = |q: &[f64; N], p: &[f64; N]| -> f64 {
        (0..N)
            .map(|a| weight(a) * q[a] + weight(N + a) * p[a])
            .sum()
    };
    let (_, gradient) = run
        .gradient(
            start,
            0.0..length,
            &Loss::at_end(move |node: &Node<N>| loss(&node.q, &node.p)),
        )
        .expect("a gradient");
    let found = gradient.by_start();
    let found: Vec<f64> = (gradient.by_parameters().iter().copied())
        .chain(found.p)
        .chain(found.q)
        .collect();
    let forwards: Vec<f64> = (s.parameters().iter())
        .map(|name| s.by(name).last())
        .map(|by| loss(&by.q, &by.p))
        .chain((0..2 * N).map(|column| {
            let by = matrix.column(column);
            loss(
                &std::array::from_fn(|a| by[N + a]),
                &std::array::from_fn(|a| by[a]),
            )
        }))
        .collect();
    compare_rows(&found, &forwards, "backwards");
    beside.off()
}

/// The same for a run with a number of steps, without constraints and events.
fn off_free<M: Model<N> + Sync, const N: usize>(
    model: &M,
    start: State<N>,
    element: Element,
    (steps, h): (u32, f64),
) -> f64 {
    let end = |start: &Phase, parameter: Option<usize>| {
        (0..steps).fold(start.clone(), |at, step| {
            let begin = number(f64::from(step) * h);
            duals::element_end(element, &at, (begin, number(h)), |t, at, rate| {
                duals::flow(model, t.by_parameter(parameter), at, rate)
            })
        })
    };
    let run = Simulation::new(model).element(element).step(h);
    off(&run, start, f64::from(steps) * h, &end)
}

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + mu*m/sqrt(x^2 + y^2) + b/2*(x*dot(y) - y*dot(x)),
)]
struct Charged {
    m: f64,
    mu: f64,
    b: f64,
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - k*x^2/2, force(x) = mu*(a - x^2)*dot(x) + f*cos(omega*t))]
struct VanDerPol {
    k: f64,
    mu: f64,
    a: f64,
    f: f64,
    omega: f64,
}

#[dynamics(
    coordinates(q[8]),
    lagrangian = sum(i in 0..8, m[i]/2*dot(q[i])^2) - sum(i in 0..7, k[i]*((q[i+1] - q[i])^2/2 + e*(q[i+1] - q[i])^4/4)) - q[0]^2/2,
    force(q[i]) = -c*dot(q[i]),
)]
struct Row {
    m: [f64; 8],
    k: [f64; 7],
    e: f64,
    c: f64,
}

#[dynamics(
    coordinates(r, theta, z),
    lagrangian = m/2*(dot(r)^2 + r^2*dot(theta)^2 + (1 + s*r^2)*dot(z)^2 + 2*s*dot(r)*dot(z)) - k*(r - l)^2/2 - m*g*z - exp(-s*z),
)]
struct Coil {
    m: f64,
    s: f64,
    k: f64,
    l: f64,
    g: f64,
}

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    hamiltonian = px^2/(2*(a + x^2)) + py^2/(2*b) + c*px*py*tanh(x)/4 + d*ln(1 + x^2 + y^2),
)]
struct Bent {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
}

/// Eight models and two elements: every operation of a run is differentiated.
#[test]
fn derivatives_are_those_of_runs_in_dual_numbers() {
    let charged = Charged {
        m: 1.3,
        mu: 1.1,
        b: 0.4,
    };
    let van_der_pol = VanDerPol {
        k: 1.1,
        mu: 0.7,
        a: 0.9,
        f: 0.3,
        omega: 1.4,
    };
    let swing = |a: usize| (a as f64).sin();
    let row = Row {
        m: std::array::from_fn(|a| 1.0 + 0.3 * swing(a)),
        k: std::array::from_fn(|a| 1.5 + 0.5 * swing(2 * a)),
        e: 0.3,
        c: 0.05,
    };
    let coil = Coil {
        m: 1.1,
        s: 0.4,
        k: 6.0,
        l: 0.8,
        g: 1.2,
    };
    let bent = Bent {
        a: 1.2,
        b: 0.8,
        c: 0.5,
        d: 0.7,
    };
    let ball = Ball {
        m: 0.7,
        g: 9.81,
        floor: -1e3,
    };
    let span = (10, 0.05);
    for element in [Element::mixed(3), Element::mixed(6)] {
        let starts = PENDULUMS.state([0.7, -0.4], [0.2, 0.5]);
        let swaying = row.state(std::array::from_fn(|a| 0.5 * swing(3 * a)), [0.1; 8]);
        let found = [
            ("pendulums", off_free(&PENDULUMS, starts, element, span)),
            ("driven", off_free(&DRIVEN, PHASE, element, span)),
            (
                "charged",
                off_free(
                    &charged,
                    charged.state([1.0, 0.1], [0.1, 1.1]),
                    element,
                    span,
                ),
            ),
            (
                "van der Pol",
                off_free(&van_der_pol, van_der_pol.state([0.5], [0.2]), element, span),
            ),
            ("row", off_free(&row, swaying, element, span)),
            (
                "coil",
                off_free(
                    &coil,
                    coil.state([1.0, 0.2, 0.1], [0.1, 0.9, -0.2]),
                    element,
                    span,
                ),
            ),
            ("bent", off_free(&bent, PHASE, element, span)),
            (
                "ball",
                off_free(&ball, ball.state([1.0], [4.0]), element, span),
            ),
        ];
        for (name, off) in found {
            assert!(off < ROUNDING, "{name}, {element}: {off:.1e}");
        }
    }
}
