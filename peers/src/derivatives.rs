//! Derivatives with respect to parameters compared with those of `diffsol`: forward and adjoint.

use crate::ways::{self, Way, Ways};
use diffsol::{
    AdjointOdeSolverMethod, DenseMatrix, NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod,
    OdeSolverState, OdeSolverStopReason, Vector,
};
use std::error::Error;
use std::time::Instant;
use tfe::prelude::*;
use tfe::sensitivity::Loss;

const N: usize = 12;
const PARAMETERS: usize = 3 * N;
const END: f64 = 20.0;
const TARGETS: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
/// The ratio of times, ours to theirs, that we aim at.
const AIM: f64 = 0.5;

/// The text above the table of the page.
pub const EXPLANATION: &str = "The gradient of ½ q₁² at t = 20 by the 36 parameters of twelve masses in a row, with friction and springs of cubic force: forward (derivatives of the whole state) and \
     backward (adjoint). Errors are relative to the largest derivative. The table shows the fastest run of each side that reaches the error. The products with the Jacobians that diffsol needs are written by hand, and its \
     derivatives are included in its error control or not, whichever is faster.";

/// Twelve masses on springs with a cubic force; each has its own mass, stiffness and damping.
#[dynamics(
    coordinates(q[12]),
    lagrangian = sum(i in 0..12, m[i]/2*dot(q[i])^2) - k[0]/2*q[0]^2 - sum(i in 1..12, k[i]/2*(q[i] - q[i-1])^2 + (q[i] - q[i-1])^4/4),
    force(q[i]) = -c[i]*dot(q[i]),
)]
struct Chain {
    m: [f64; 12],
    k: [f64; 12],
    c: [f64; 12],
}

/// The force of a spring, and its derivative.
fn spring(k: f64, stretch: f64) -> (f64, f64) {
    let square = stretch * stretch;
    (stretch * (k + square), k + 3.0 * square)
}

/// The elongations of the springs; the first one is attached to the wall, and linear.
fn stretch(q: &[f64], i: usize) -> f64 {
    if i == 0 { q[0] } else { q[i] - q[i - 1] }
}

/// The forces without friction, or their change in a direction: `of` is the force of a spring, or its derivative times
/// the change of its elongation.
fn add_springs(forces: &mut [f64], of: impl Fn(usize) -> f64) {
    for i in 0..N {
        let force = of(i);
        forces[i] -= force;
        if i > 0 {
            forces[i - 1] += force;
        }
    }
}

fn force_of(p: &[f64], q: &[f64], i: usize) -> (f64, f64) {
    if i == 0 {
        (p[N] * q[0], p[N])
    } else {
        spring(p[N + i], stretch(q, i))
    }
}

/// y' = f(y, p), y = (q, q̇), p = (m, k, c).
fn rates(y: &[f64], p: &[f64], _: f64, out: &mut [f64]) {
    let (q, v) = y.split_at(N);
    let (dq, dv) = out.split_at_mut(N);
    dq.copy_from_slice(v);
    dv.fill(0.0);
    add_springs(dv, |i| force_of(p, q, i).0);
    for i in 0..N {
        dv[i] = (dv[i] - p[2 * N + i] * v[i]) / p[i];
    }
}

/// ∂f/∂y w
fn along(y: &[f64], p: &[f64], _: f64, w: &[f64], out: &mut [f64]) {
    let (q, _) = y.split_at(N);
    let (wq, wv) = w.split_at(N);
    let (dq, dv) = out.split_at_mut(N);
    dq.copy_from_slice(wv);
    dv.fill(0.0);
    add_springs(dv, |i| force_of(p, q, i).1 * stretch(wq, i));
    for i in 0..N {
        dv[i] = (dv[i] - p[2 * N + i] * wv[i]) / p[i];
    }
}

/// ∂f/∂p w
fn by_parameters(y: &[f64], p: &[f64], _: f64, w: &[f64], out: &mut [f64]) {
    let (q, v) = y.split_at(N);
    let (dq, dv) = out.split_at_mut(N);
    dq.fill(0.0);
    let mut force = [0.0; N];
    add_springs(&mut force, |i| force_of(p, q, i).0);
    dv.fill(0.0);
    add_springs(dv, |i| w[N + i] * stretch(q, i));
    for i in 0..N {
        let acceleration = (force[i] - p[2 * N + i] * v[i]) / p[i];
        dv[i] = (dv[i] - w[2 * N + i] * v[i] - w[i] * acceleration) / p[i];
    }
}

/// −(∂f/∂y)ᵀ w
fn transposed(y: &[f64], p: &[f64], _: f64, w: &[f64], out: &mut [f64]) {
    let (q, _) = y.split_at(N);
    let (wq, wv) = w.split_at(N);
    let mut seeds = [0.0; N];
    for i in 0..N {
        seeds[i] = wv[i] / p[i];
    }
    let (dq, dv) = out.split_at_mut(N);
    dq.fill(0.0);
    // Minus that of the springs, whose matrix is symmetric.
    add_springs(dq, |i| -force_of(p, q, i).1 * stretch(&seeds, i));
    for i in 0..N {
        dv[i] = p[2 * N + i] * seeds[i] - wq[i];
    }
}

/// −(∂f/∂p)ᵀ w
fn parameters_transposed(y: &[f64], p: &[f64], _: f64, w: &[f64], out: &mut [f64]) {
    let (q, v) = y.split_at(N);
    let (_, wv) = w.split_at(N);
    let mut force = [0.0; N];
    add_springs(&mut force, |i| force_of(p, q, i).0);
    let mut seeds = [0.0; N];
    for i in 0..N {
        seeds[i] = wv[i] / p[i];
        out[i] = seeds[i] * (force[i] - p[2 * N + i] * v[i]) / p[i];
        out[2 * N + i] = seeds[i] * v[i];
    }
    for i in 0..N {
        out[N + i] = stretch(&seeds, i) * stretch(q, i);
    }
}

fn start() -> [f64; N] {
    std::array::from_fn(|a| (a as f64).sin())
}

fn model() -> Chain {
    Chain {
        m: std::array::from_fn(|a| 1.0 + 0.2 * (a as f64).cos()),
        k: std::array::from_fn(|a| 1.0 + 0.1 * (a as f64).sin()),
        c: [0.05; N],
    }
}

type M = NalgebraMat<f64>;
type LU = NalgebraLU<f64>;
type Gradient = [f64; PARAMETERS];
type Found = Result<(f64, Gradient), Box<dyn Error>>;

/// A problem for the peer with tolerances, and one of the two kinds of derivatives.
macro_rules! problem {
    ($tolerance:expr, $controlled:expr, $kind:ident) => {{
        let chain = model();
        let p = [chain.m, chain.k, chain.c].as_flattened().to_vec();
        let builder = OdeBuilder::<M>::new()
            .rtol($tolerance)
            .atol([$tolerance; 2 * N])
            .p(p);
        let builder = problem!(@$kind builder);
        let builder = if $controlled {
            builder
                .sens_rtol($tolerance)
                .sens_atol([$tolerance; 2 * N])
                .param_rtol($tolerance)
                .param_atol([$tolerance; PARAMETERS])
        } else {
            builder
                .turn_off_sensitivities_error_control()
                .turn_off_param_error_control()
        };
        builder.build()?
    }};
    (@forwards $builder:ident) => {
        $builder
            .rhs_sens_implicit(rates, along, by_parameters)
            .init_sens(
                |_: &[f64], _: f64, y: &mut [f64]| at_start(y),
                |_: &[f64], _: f64, _: &[f64], y: &mut [f64]| y.fill(0.0),
                2 * N,
            )
    };
    (@backwards $builder:ident) => {
        $builder
            .rhs_adjoint_implicit(rates, along, transposed, parameters_transposed)
            .init_adjoint(
                |_: &[f64], _: f64, y: &mut [f64]| at_start(y),
                |_: &[f64], _: f64, _: &[f64], y: &mut [f64]| y.fill(0.0),
                2 * N,
            )
            .out_adjoint_implicit(
                |y: &[f64], _: &[f64], _: f64, out: &mut [f64]| out[0] = y[0],
                |_: &[f64], _: &[f64], _: f64, w: &[f64], out: &mut [f64]| out[0] = w[0],
                |_: &[f64], _: &[f64], _: f64, w: &[f64], out: &mut [f64]| {
                    out.fill(0.0);
                    out[0] = -w[0];
                },
                |_: &[f64], _: &[f64], _: f64, _: &[f64], out: &mut [f64]| out.fill(0.0),
                1,
            )
    };
}

fn at_start(y: &mut [f64]) {
    y[..N].copy_from_slice(&start());
    y[N..].fill(0.0);
}

macro_rules! forwards {
    ($name:ident, $solver:ident $(::<$linear:ty>)?) => {
        fn $name(tolerance: f64, controlled: bool) -> Found {
            let problem = problem!(tolerance, controlled, forwards);
            let mut solver = problem.$solver$(::<$linear>)?()?;
            let clock = Instant::now();
            solver.set_stop_time(END)?;
            while !matches!(solver.step()?, OdeSolverStopReason::TstopReached) {}
            let state = solver.state();
            let (q, s) = (state.y[0], state.s.clone_as_vec());
            let gradient = std::array::from_fn(|at| q * s[2 * N * at]);
            Ok((clock.elapsed().as_secs_f64(), gradient))
        }
    };
}

macro_rules! backwards {
    ($name:ident, $solver:ident, $adjoint:ident $(, $linear:ty)?) => {
        fn $name(tolerance: f64, controlled: bool) -> Found {
            let problem = problem!(tolerance, controlled, backwards);
            let mut solver = problem.$solver$(::<$linear>)?()?;
            let clock = Instant::now();
            let (path, ..) = solver.solve_dense_with_checkpointing(&[END], None)?;
            let q = solver.state().y[0];
            let adjoint = problem.$adjoint$(::<$linear, _>)?(path, Some(solver), Some(1))?;
            let seed = M::from_vec(1, 1, vec![q], *problem.context());
            let (state, _) = adjoint.solve_adjoint_backwards_pass(&[END], &[&seed])?;
            let sums = state.as_ref().sg.clone_as_vec();
            Ok((clock.elapsed().as_secs_f64(), std::array::from_fn(|at| sums[at])))
        }
    };
}

forwards!(tsit45, tsit45_sens);
forwards!(esdirk34, esdirk34_sens::<LU>);
forwards!(bdf, bdf_sens::<LU>);
backwards!(tsit45_back, tsit45, tsit45_solver_adjoint);
backwards!(esdirk34_back, esdirk34, esdirk34_solver_adjoint, LU);
backwards!(bdf_back, bdf, bdf_solver_adjoint, LU);

type Method = fn(f64, bool) -> Found;

fn peers<'k>(methods: [(&'static str, Method); 3], known: &'k Gradient) -> Vec<Way<'k>> {
    let mut ways = Vec::new();
    for (name, method) in methods {
        for k in 6..=26 {
            let tolerance = 10.0_f64.powf(-0.5 * f64::from(k));
            for controlled in [false, true] {
                let told = if controlled { "controlled" } else { "alone" };
                ways.push(Way {
                    name: format!("{name}, {tolerance:.1e} {told}"),
                    run: Box::new(move || measured(method(tolerance, controlled), known)),
                });
            }
        }
    }
    ways
}

fn ours(is_backwards: bool, known: &Gradient) -> Vec<Way<'_>> {
    let mut ways = Vec::new();
    for nodes in [3, 4, 5, 6, 7, 8, 9, 12] {
        for steps in [10, 14, 20, 28, 40, 56, 80, 112, 160, 224, 320, 640] {
            let run = move || -> Found {
                let chain = model();
                let simulation = Simulation::new(&chain).element(Element::mixed(nodes));
                let simulation = simulation.step(END / f64::from(steps));
                let start = chain.state(start(), [0.0; N]);
                let clock = Instant::now();
                let gradient = if is_backwards {
                    let loss = Loss::at_end(|node| 0.5 * node.q[0] * node.q[0]);
                    let (_, gradient) = simulation.gradient(start, 0.0..END, &loss)?;
                    let all = gradient.by_parameters();
                    std::array::from_fn(|at| all[at])
                } else {
                    let simulation = simulation.record_every(usize::MAX);
                    let sensitive = simulation.run_sensitive(start, 0.0..END)?;
                    let q = sensitive.motion().last().q[0];
                    let names = sensitive.parameters();
                    std::array::from_fn(|at| q * sensitive.by(&names[at]).last().q[0])
                };
                Ok((clock.elapsed().as_secs_f64(), gradient))
            };
            ways.push(Way {
                name: format!("Mixed {nodes}, {steps} steps"),
                run: Box::new(move || measured(run(), known)),
            });
        }
    }
    ways
}

/// The largest difference divided by the largest derivative; NaN if there is one.
fn error(found: &Gradient, known: &Gradient) -> f64 {
    let largest = known.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let apart = found.iter().zip(known).map(|(a, b)| (a - b).abs());
    apart.max_by(f64::total_cmp).unwrap_or(f64::NAN) / largest
}

/// The seconds and the error of a setting that has not failed.
fn measured(found: Found, known: &Gradient) -> Option<(f64, f64)> {
    let (seconds, gradient) = found.ok()?;
    Some((seconds, error(&gradient, known)))
}

/// The columns.
pub const HEADER: [&str; 7] = [
    "derivatives",
    "error",
    "our element, steps",
    "time",
    "diffsol's method, tolerance",
    "its time",
    "ratio",
];

/// A row for each kind of derivatives and each error to be reached.
pub fn table() -> Result<Vec<[String; 7]>, Box<dyn Error>> {
    let reference = |steps: u32| -> Result<Gradient, Box<dyn Error>> {
        let chain = model();
        let loss = Loss::at_end(|node| 0.5 * node.q[0] * node.q[0]);
        let simulation = Simulation::new(&chain).element(Mixed::<9>);
        let simulation = simulation.step(END / f64::from(steps));
        let start = chain.state(start(), [0.0; N]);
        let (_, gradient) = simulation.gradient(start, 0.0..END, &loss)?;
        Ok(std::array::from_fn(|at| gradient.by_parameters()[at]))
    };
    let known = reference(800)?;
    let uncertainty = error(&reference(400)?, &known);
    let (theirs, of_theirs) = (tsit45(1e-12, true)?.1, tsit45_back(1e-12, true)?.1);
    println!(
        "  reference known to {uncertainty:.1e}; diffsol at 1e-12 differs by {:.1e} forwards, {:.1e} backwards",
        error(&theirs, &known),
        error(&of_theirs, &known)
    );
    let mut rows = Vec::new();
    for is_backwards in [false, true] {
        let methods: [(&str, Method); 3] = if is_backwards {
            [
                ("Tsitouras 5(4)", tsit45_back),
                ("ESDIRK34", esdirk34_back),
                ("BDF", bdf_back),
            ]
        } else {
            [
                ("Tsitouras 5(4)", tsit45),
                ("ESDIRK34", esdirk34),
                ("BDF", bdf),
            ]
        };
        let ours = Ways::look_at(ours(is_backwards, &known));
        let peers = Ways::look_at(peers(methods, &known));
        let way = if is_backwards {
            "backwards"
        } else {
            "forwards"
        };
        let what = format!("{way}, 36 parameters");
        rows.extend(TARGETS.map(|target| ways::row(&what, target, [&ours, &peers], AIM)));
    }
    Ok(rows)
}
