//! Derivatives of motions by parameters and initial states, compared with differences of runs.

#[path = "../common/composed.rs"]
mod composed;
#[path = "../common/differences.rs"]
mod differences;
#[path = "../common/duals.rs"]
mod duals;

mod backwards;
mod dual_runs;
mod events;
mod forwards;
mod inside;
mod quaternions;
mod second;

use composed::{compare_rows, row};
use differences::difference;
use tfe::prelude::*;
use tfe::runtime::step::{Control, Stepper};
use tfe::runtime::{Direction, Model, Parameter};
use tfe::sensitivity::Loss;
use tfe::{RunErrorKind, Sensitive};

/// The state at the end of a run as one array, q and p.
fn end<M: Model<N> + Sync, const N: usize, const D: usize>(
    simulation: &Simulation<'_, M, N>,
    start: State<N>,
    end: f64,
) -> [f64; D] {
    let motion = simulation.run(start, 0.0..end).expect("a good run");
    let last = motion.last();
    std::array::from_fn(|a| if a < N { last.q[a] } else { last.p[a - N] })
}

/// The gradient of a loss by all parameters and by the initial state, and the loss, as one row.
fn gradient_of<M: Model<N> + Sync, const N: usize>(
    simulation: &Simulation<'_, M, N>,
    start: State<N>,
    span: std::ops::Range<f64>,
    loss: &Loss<'_, N>,
) -> Vec<f64> {
    row(&simulation.gradient(start, span, loss).expect("a gradient"))
}

/// Compares all derivatives of a run with differences; `allowed` is relative to the largest derivative by the same
/// parameter.
fn check<M: Model<N> + Sync, const N: usize, const D: usize>(
    model: &M,
    start: State<N>,
    length: f64,
    allowed: f64,
    simulation: impl for<'m> Fn(&'m M) -> Simulation<'m, M, N>,
    by_start: bool,
) -> Sensitive<N> {
    assert_eq!(D, 2 * N);
    let s = simulation(model)
        .run_sensitive(start, 0.0..length)
        .expect("derivatives");
    assert_eq!(s.motion().last().t, length);
    assert_eq!(s.parameters().len(), model.parameters());
    let compare = |what: &str, found: [f64; D], expected: [f64; D]| {
        let scale = expected.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
        for a in 0..D {
            let error = (found[a] - expected[a]).abs() / scale;
            assert!(
                error < allowed,
                "{what}, entry {a}: {} instead of {}, off by {error:.1e}",
                found[a],
                expected[a]
            );
        }
    };
    for (index, name) in s.parameters().iter().enumerate() {
        let expected = difference(
            |value| {
                let other = model.with_parameter(index, value).expect("numbers alone");
                end::<M, N, D>(&simulation(&other), start, length)
            },
            model.parameter(index),
        );
        let last = s.by(name).last();
        let found = std::array::from_fn(|a| if a < N { last.q[a] } else { last.p[a - N] });
        compare(name, found, expected);
        assert_eq!(s.by(name).states().len(), s.motion().states().len());
        assert_eq!(s.by(name).states()[0].q, [0.0; N], "{name}");
    }
    if by_start {
        let matrix = s.by_start().last();
        for k in 0..D {
            let changed = |x: f64| {
                let mut start = start;
                if k < N {
                    start.q[k] = x;
                } else {
                    start.p[k - N] = x;
                }
                end::<M, N, D>(&simulation(model), start, length)
            };
            let x = if k < N { start.q[k] } else { start.p[k - N] };
            // Matrices are ordered (p, q).
            let (row, column) = (|a| (a + N) % D, (k + N) % D);
            let found = std::array::from_fn(|a| matrix[(row(a), column)]);
            compare(&format!("start {k}"), found, difference(changed, x));
        }
    }
    s
}

/// Two pendulums with friction. The parameters in `sensitivity` have kernels of their own, the others are
/// differentiated by dual numbers.
#[dynamics(
    coordinates(theta[2]),
    let x1 = l[0]*sin(theta[0]), let y1 = -l[0]*cos(theta[0]),
    let x2 = x1 + l[1]*sin(theta[1]), let y2 = y1 - l[1]*cos(theta[1]),
    lagrangian = m1/2*(dot(x1)^2 + dot(y1)^2) + m2/2*(dot(x2)^2 + dot(y2)^2) - g*(m1*y1 + m2*y2),
    force(theta[0]) = -c*dot(theta[0]),
    force(theta[1]) = -c*(dot(theta[1]) - dot(theta[0])),
    sensitivity(g, l[1]),
    output(height) = y2,
    output(speed) = sqrt(dot(x2)^2 + dot(y2)^2),
)]
struct Pendulums {
    l: [f64; 2],
    m1: f64,
    m2: f64,
    g: f64,
    c: f64,
}

const PENDULUMS: Pendulums = Pendulums {
    l: [1.0, 0.8],
    m1: 1.0,
    m2: 0.7,
    g: 9.81,
    c: 0.1,
};

/// A Hamiltonian that also depends on time, in phase space and with velocities.
#[dynamics(
    coordinates(x, y),
    hamiltonian = (px^2 + py^2)/(2*m) + k*(x^2 + y^2)/2 + b*(x^2*y - y^3/3) + a*x*cos(omega*t),
    momenta(px, py),
    force(y) = -c*py,
    output(moment) = x*py - y*px,
)]
struct Driven {
    m: f64,
    k: f64,
    b: f64,
    a: f64,
    omega: f64,
    c: f64,
}

const DRIVEN: Driven = Driven {
    m: 1.2,
    k: 1.0,
    b: 0.8,
    a: 0.3,
    omega: 1.7,
    c: 0.05,
};

/// An initial state in phase space.
const PHASE: State<2> = State {
    q: [0.2, 0.3],
    p: [0.1, -0.2],
};

/// A pendulum with a rod, and a redundant constraint; the length is a parameter of the constraints.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    force(x) = -c*dot(x),
    constraint(rod) = x^2 + y^2 - l^2,
    output(height) = y,
)]
struct Rod {
    m: f64,
    g: f64,
    c: f64,
    l: f64,
}

const ROD: Rod = Rod {
    m: 1.3,
    g: 9.81,
    c: 0.2,
    l: 1.0,
};

#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
    constraint(again) = (x^2 + y^2)/l - l,
)]
struct Twice {
    m: f64,
    g: f64,
    l: f64,
}

/// A top with a fixed point and a drag: its attitude is a unit quaternion, the mass matrix is singular, and constraints
/// determine the velocity of a momentum.
#[dynamics(
    coordinates(e[4]),
    let w = body_rate(e),
    lagrangian = (i1*w[0]^2 + i2*w[1]^2 + i3*w[2]^2)/2 - mgd*(e[0]^2 - e[1]^2 - e[2]^2 + e[3]^2),
    force(e[0]) = -c*dot(e[0]),
    constraint(unit) = (inner(e, e) - 1)/2,
    output(w1) = w[0],
    output(w2) = w[1],
)]
#[derive(Clone, Copy)]
struct Top {
    i1: f64,
    i2: f64,
    i3: f64,
    mgd: f64,
    c: f64,
}

/// A blade on a slope: a constraint on velocities whose direction rotates.
#[dynamics(
    coordinates(x, y, phi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(phi)^2 + m*g*slope*x,
    constraint(blade) = sin(phi)*dot(x) - cos(phi)*dot(y),
)]
struct Blade {
    m: f64,
    j: f64,
    g: f64,
    slope: f64,
}

/// A bouncing ball: closed forms, also for the time of the bounce.
#[dynamics(
    coordinates(y),
    lagrangian = m/2*dot(y)^2 - m*g*y,
    event(impact) = y - floor,
    output(velocity) = dot(y),
    output(height) = y,
    output(clock) = t,
)]
struct Ball {
    m: f64,
    g: f64,
    floor: f64,
}

fn bouncing(ball: &Ball) -> Simulation<'_, Ball, 1> {
    Simulation::new(ball)
        .step(0.1)
        .on("impact", Crossing::Falling, |event| {
            Act::Restart(event.state_with_velocity([-0.8 * event.v[0]]))
        })
}
