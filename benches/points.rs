//! All quadrature points of an element evaluated at once, compared with one after the other: the same fixed-point
//! iteration of `Mixed::<9>` with eight points.
//!
//! `cargo bench --bench points` prints both times per step and their ratio.

use std::hint::black_box;
use std::time::Instant;
use tfe::prelude::*;
use tfe::runtime::scheme::SchemeTable;
use tfe::runtime::step::{Control, Interval, Memory, Method, Stepper};
use tfe::runtime::workspace::{Workspace, numbers_len, pivots_len};

#[dynamics(coordinates(theta), lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta))]
struct Pendulum {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics(
    coordinates(theta1, theta2),
    let x1 = l1*sin(theta1),
    let y1 = -l1*cos(theta1),
    let x2 = x1 + l2*sin(theta2),
    let y2 = y1 - l2*cos(theta2),
    lagrangian = m1/2*(dot(x1)^2 + dot(y1)^2) + m2/2*(dot(x2)^2 + dot(y2)^2) - g*(m1*y1 + m2*y2),
)]
struct DoublePendulum {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}

#[dynamics(coordinates(x, y), momenta(px, py), hamiltonian = (px^2 + py^2 + x^2 + y^2)/2 + x^2*y - y^3/3)]
struct HenonHeiles {}

/// Toda's lattice of three masses, with exponentials.
#[dynamics(
    coordinates(a, b, c),
    momenta(pa, pb, pc),
    hamiltonian = (pa^2 + pb^2 + pc^2)/2 + exp(a - b) + exp(b - c) + exp(c - a),
)]
struct Toda {}

/// Smoothed Coulomb friction.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = -mu*tanh(dot(x)/eps))]
struct Friction {
    mu: f64,
    eps: f64,
}

/// Forces with logarithms.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - x^2/2 - y^2/2,
    force(x) = -ln(1 + x^2 + y^2), force(y) = x*ln(2 + x^2),
)]
struct Logarithms {}

/// A central force proportional to a power of the distance.
#[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 + (x^2 + y^2)^(-k/2))]
struct Power {
    k: f64,
}

/// A spring that winds about an axis.
#[dynamics(
    coordinates(x, y),
    lagrangian = (dot(x)^2 + dot(y)^2)/2 - k/2*atan2(y, x)^2 - (x^2 + y^2)/2,
)]
struct WoundSpring {
    k: f64,
}

const STEPS: u32 = 2_000;
const ELEMENT: Element = Mixed::<9>.element();

type Failure = Box<dyn std::error::Error>;

/// The smallest time of several runs, in nanoseconds per step.
fn best(mut run: impl FnMut() -> Result<(), Failure>) -> Result<f64, Failure> {
    let mut best = f64::INFINITY;
    for _ in 0..15 {
        let start = Instant::now();
        run()?;
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS));
    }
    Ok(best)
}

fn measure<M: Model<N>, const N: usize>(
    name: &str,
    model: &M,
    start: State<N>,
    h: f64,
) -> Result<(), Failure> {
    let control = Control::default();
    let mut iterations = [0; 2];
    let together = best(|| {
        let mut stepper = Stepper::new(model, ELEMENT, control)?.ends_only();
        let mut state = start;
        for step in 0..STEPS {
            stepper.advance(h * f64::from(step), h, &mut state, &[])?;
        }
        iterations[0] = stepper.statistics().iterations;
        black_box(state);
        Ok(())
    })?;
    let tables = SchemeTable::new(ELEMENT)?;
    let method = Method {
        model,
        tables: &tables,
        control,
    };
    let mut numbers = vec![0.0; numbers_len(ELEMENT, M::FORM, N, 0)];
    let mut pivots = vec![0; pivots_len(ELEMENT, M::FORM, N, 0)];
    let apart = best(|| {
        let mut memory = Memory::new();
        let mut state = start;
        for step in 0..STEPS {
            let workspace = Workspace {
                numbers: &mut numbers,
                pivots: &mut pivots,
            };
            let interval = Interval {
                start: h * f64::from(step),
                length: h,
                impulses: &[],
            };
            method.advance(&mut memory, workspace, interval, &mut state)?;
        }
        iterations[1] = memory.statistics().iterations;
        black_box(state);
        Ok(())
    })?;
    let [with, without] = iterations.map(|count| count as f64 / f64::from(STEPS));
    println!(
        "{name:<16} {apart:8.0} ns ({without:.1} iterations) {together:8.0} ns ({with:.1}) {:8.2}",
        apart / together
    );
    Ok(())
}

fn main() -> Result<(), Failure> {
    println!("a step of {ELEMENT}   one by one               at once            ratio");
    let pendulum = Pendulum {
        m: 1.0,
        l: 1.0,
        g: 9.81,
    };
    measure("pendulum", &pendulum, pendulum.state([1.5], [0.3]), 0.1)?;
    let double = DoublePendulum {
        m1: 1.0,
        m2: 1.0,
        l1: 1.0,
        l2: 1.0,
        g: 9.81,
    };
    let start = double.state([0.5, -0.3], [0.0, 0.0]);
    measure("double pendulum", &double, start, 0.05)?;
    let start = State {
        q: [0.1, 0.0],
        p: [0.0, 0.5],
    };
    measure("Hénon–Heiles", &HenonHeiles {}, start, 0.2)?;
    let start = State {
        q: [0.3, 0.0, -0.2],
        p: [0.0, 0.5, -0.5],
    };
    measure("Toda's lattice", &Toda {}, start, 0.1)?;
    let friction = Friction { mu: 0.1, eps: 0.5 };
    measure("friction", &friction, friction.state([1.0], [0.0]), 0.05)?;
    let start = Logarithms {}.state([0.5, 0.0], [0.0, 0.5]);
    measure("logarithms", &Logarithms {}, start, 0.1)?;
    let power = Power { k: 1.3 };
    measure("power", &power, power.state([1.0, 0.0], [0.0, 0.9]), 0.1)?;
    let wound = WoundSpring { k: 1.0 };
    let start = wound.state([1.0, 0.5], [0.0, 0.2]);
    measure("wound spring", &wound, start, 0.1)
}
