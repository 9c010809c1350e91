//! Lattices of any length from one declaration each: time per step over the length, energy errors, invariants.
//!
//! The chain of Fermi, Pasta, Ulam and Tsingou with quadratic forces (Studies of nonlinear problems, Los Alamos report
//! LA-1940, 1955), and that of Toda (Vibration of a chain with nonlinear interaction, J. Phys. Soc. Japan 22 (1967)
//! 431–436), both with free ends, in natural units:
//!
//! ```text
//! L = Σ ½ q̇_i² − Σ (½ r_i² + α/3 r_i³),  r_i = q_{i+1} − q_i            H = Σ ½ p_i² + Σ e^{−r_i}
//! ```
//!
//! The sums become loops in the derived code, which is the same for all lengths: time per step and memory grow linearly
//! with the length, and the time to compile does not depend on it. The table shows this for lengths from 10 to 100 000,
//! and a chart shows the time per step over the length.
//!
//! Toda's chain is integrable: the eigenvalues of Lax's tridiagonal matrix, with −p_i/2 on the diagonal and
//! e^{−r_i/2}/2 beside it (H. Flaschka, The Toda lattice II, Phys. Rev. B 9 (1974) 1924), are invariants. The last line
//! of the output shows by how much they change.

use nalgebra::DMatrix;
use std::error::Error;
use std::time::Instant;
use tfe::charts::{Axis, Chart, Scale, Style};
use tfe::family::{self, FamilyState};
use tfe::prelude::*;
use tfe::runtime::step::Control;

#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, dot(q[i])^2/2) - sum(i in 0..n-1, (q[i+1]-q[i])^2/2 + alpha/3*(q[i+1]-q[i])^3),
)]
struct Fput {
    n: usize,
    alpha: f64,
}

#[dynamics(
    coordinates(q[n]), momenta(p[n]),
    hamiltonian = sum(i in 0..n, p[i]^2/2) + sum(i in 0..n-1, exp(q[i]-q[i+1])),
)]
struct Toda {
    n: usize,
}

const LENGTHS: [usize; 5] = [10, 100, 1000, 10_000, 100_000];
const STEP: f64 = 0.1;
const STEPS: u32 = 50;

/// The results for one length.
struct Row {
    n: usize,
    microseconds: f64,
    /// The peak memory while a stepper works, in bytes per body.
    bytes: f64,
    iterations: f64,
    energy_error: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("{}\n", Fput::structure());
    println!("{}\n", Toda::structure());
    let fput = sweep(|n| Fput { n, alpha: 0.25 })?;
    let toda = sweep(|n| Toda { n })?;
    let curves = [("FPUT", fput), ("Toda", toda)];
    let mut chart = Chart::new("A step of Mixed::<4> over the length of the chain")
        .x(Axis::new("bodies").scale(Scale::Logarithmic))
        .y(Axis::new("time per step (µs)").scale(Scale::Logarithmic));
    for (name, rows) in &curves {
        println!(
            "{name:<6} {:>8} {:>13} {:>11} {:>13} {:>10} {:>13}",
            "n", "µs per step", "ns per body", "bytes/body", "it./step", "energy error"
        );
        for row in rows {
            let by_body = 1e3 * row.microseconds / row.n as f64;
            println!(
                "{:<6} {:>8} {:>13.2} {by_body:>11.1} {:>13.0} {:>10.1} {:>13.1e}",
                "", row.n, row.microseconds, row.bytes, row.iterations, row.energy_error
            );
        }
        let exponent = exponent(&rows[2..]);
        println!("       time grows as n^{exponent:.2} from 10³ to 10⁵\n");
        let points = rows.iter().map(|row| (row.n as f64, row.microseconds));
        chart = chart.series(*name, Style::LineWithMarkers, points);
    }
    invariants()?;
    let linear = [10.0, 1e5].map(|n| (n, 0.1 * n));
    let path = std::env::temp_dir().join("tfe-lattices.svg");
    chart
        .series("100 ns per body", Style::Reference, linear)
        .save(&path)?;
    println!("chart: {}", path.display());
    Ok(())
}

/// Runs a chain with each length over the same span, and keeps the shortest of several times.
fn sweep<M: family::Model>(model: impl Fn(usize) -> M) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for n in LENGTHS {
        let model = model(n);
        let q = (0..n).map(|i| (0.1 * i as f64).sin()).collect();
        let start = family::state(&model, 0.0, q, vec![0.0; n]);
        // Without optimisation, times are not meaningful: one run is enough.
        let runs = match cfg!(debug_assertions) {
            true => 1,
            false => (300_000 / n).clamp(2, 500),
        };
        let simulation = Simulation::new(&model).element(Mixed::<4>).step(STEP);
        let simulation = simulation.record_every(usize::MAX);
        let mut row = Row {
            n,
            microseconds: f64::INFINITY,
            bytes: bytes(&model, &start)? / n as f64,
            iterations: 0.0,
            energy_error: 0.0,
        };
        for _ in 0..runs {
            let clock = Instant::now();
            let motion = simulation.run(start.clone(), 0.0..STEP * f64::from(STEPS))?;
            let time = 1e6 * clock.elapsed().as_secs_f64() / f64::from(STEPS);
            row.microseconds = row.microseconds.min(time);
            row.iterations = motion.statistics().iterations as f64 / f64::from(STEPS);
            row.energy_error = motion.energy_error();
        }
        assert!(
            row.energy_error < 1e-7,
            "energy error {:e}, too large for an element of order 6 with this step",
            row.energy_error
        );
        rows.push(row);
    }
    Ok(rows)
}

/// The peak memory of a stepper while it is made and does a few steps, in bytes.
fn bytes<M: family::Model>(model: &M, start: &FamilyState) -> Result<f64, Box<dyn Error>> {
    let mut outcome = Ok(());
    let used = allocation_counter::measure(|| {
        outcome = family::Stepper::new(model, Mixed::<4>.into(), Control::default())
            .map_err(Box::<dyn Error>::from)
            .and_then(|mut stepper| {
                let mut state = start.clone();
                for step in 0..3 {
                    stepper.advance(f64::from(step) * STEP, STEP, &mut state)?;
                }
                Ok(())
            });
    });
    outcome?;
    Ok(used.bytes_max as f64)
}

/// The slope of log(time) over log(n), by least squares.
fn exponent(rows: &[Row]) -> f64 {
    let logarithm = |row: &Row| ((row.n as f64).ln(), row.microseconds.ln());
    let points: Vec<(f64, f64)> = rows.iter().map(logarithm).collect();
    let count = points.len() as f64;
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>();
    let (x, y) = (sum(&|p| p.0) / count, sum(&|p| p.1) / count);
    sum(&|p| (p.0 - x) * (p.1 - y)) / sum(&|p| (p.0 - x).powi(2))
}

/// Prints by how much the eigenvalues of Lax's matrix change in 1000 units of time.
fn invariants() -> Result<(), Box<dyn Error>> {
    let toda = Toda { n: 200 };
    let q: Vec<f64> = (0..200).map(|i| 0.3 * (0.2 * f64::from(i)).sin()).collect();
    let v: Vec<f64> = (0..200).map(|i| 0.5 * (0.7 * f64::from(i)).cos()).collect();
    let start = toda.state(q, v);
    let before = eigenvalues(&start);
    let simulation = Simulation::new(&toda)
        .element(Mixed::<8>)
        .step(0.25)
        .record_every(1000);
    let motion = simulation.run(start, 0.0..1000.0)?;
    let after = eigenvalues(&motion.last().state());
    let moved = before.iter().zip(&after).map(|(a, b)| (a - b).abs());
    let moved = moved.max_by(f64::total_cmp).unwrap_or(f64::NAN);
    println!(
        "Toda, n = 200, t = 1000: eigenvalues change by {moved:.1e}, energy error {:.1e}",
        motion.energy_error()
    );
    assert!(moved < 1e-10, "{moved:e}");
    Ok(())
}

fn eigenvalues(state: &FamilyState) -> Vec<f64> {
    let n = state.q.len();
    let mut lax = DMatrix::zeros(n, n);
    for i in 0..n {
        lax[(i, i)] = -0.5 * state.p[i];
        if i + 1 < n {
            let beside = 0.5 * (0.5 * (state.q[i] - state.q[i + 1])).exp();
            (lax[(i, i + 1)], lax[(i + 1, i)]) = (beside, beside);
        }
    }
    let mut values: Vec<f64> = lax.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}
