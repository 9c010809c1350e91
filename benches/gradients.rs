//! The time of gradients by many parameters relative to that of the runs: `cargo bench --features sparse --bench
//! gradients`.

use std::hint::black_box;
use std::time::{Duration, Instant};
use tfe::prelude::*;
use tfe::sensitivity::Loss;

const STEPS: u32 = 200;
const STEP: f64 = 0.1;

type Failure = Box<dyn std::error::Error>;

/// Twelve masses on springs with a cubic force; each has its own mass, stiffness and damping.
#[dynamics(
    coordinates(q[12]),
    lagrangian = sum(i in 0..12, m[i]/2*dot(q[i])^2) - k[0]/2*q[0]^2 - sum(i in 1..12, k[i]/2*(q[i] - q[i-1])^2 + (q[i] - q[i-1])^4/4),
    force(q[i]) = -c[i]*dot(q[i]),
    output(loss) = sum(i in 0..12, c[i]*dot(q[i])^2),
)]
struct Chain {
    m: [f64; 12],
    k: [f64; 12],
    c: [f64; 12],
}

/// Thirty-two masses, with a spring between any two of them, and a spring with another force from each to the ground.
#[dynamics(
    coordinates(q[32]),
    lagrangian = sum(i in 0..32, dot(q[i])^2/2 - a*q[i]^4/4)
        - sum(i in 1..32, sum(j in 0..i, (k[32*i+j] + k[32*j+i])*(q[i] - q[j])^2/4)),
    output(loss) = sum(i in 0..32, a*q[i]^4),
)]
struct Net {
    a: f64,
    k: [f64; 1024],
}

/// A row of masses of any number, with the stiffnesses of the springs between them as parameters.
#[cfg(feature = "sparse")]
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k[i]*((q[i+1] - q[i])^2/2 + b*(q[i+1] - q[i])^4/4)),
    output(loss) = sum(i in 0..n-1, k[i]*(q[i+1] - q[i])^2),
)]
struct Row {
    n: usize,
    m: f64,
    b: f64,
    k: Vec<f64>,
}

/// The smallest time of several calls of each; they are called in turn, so that all see the same machine.
fn least(
    mut calls: [&mut dyn FnMut() -> Result<(), Failure>; 3],
) -> Result<[Duration; 3], Failure> {
    const TURNS: usize = 15;
    let mut least = [Duration::MAX; 3];
    for _ in 0..TURNS {
        for (call, least) in calls.iter_mut().zip(&mut least) {
            let begin = Instant::now();
            call()?;
            *least = begin.elapsed().min(*least);
        }
    }
    Ok(least)
}

fn compare<M, const N: usize>(name: &str, model: &M, start: State<N>) -> Result<(), Failure>
where
    M: tfe::runtime::Model<N>
        + tfe::runtime::length::Declared<N, Length = tfe::runtime::length::FixedLength>,
{
    let simulation = Simulation::new(model).step(STEP);
    let span = || 0.0..STEP * f64::from(STEPS);
    let loss = Loss::at_end(|node| 0.5 * node.q[0] * node.q[0]);
    let mut run = || {
        black_box(simulation.run(start, span())?);
        Ok(())
    };
    let mut gradient = || {
        black_box(simulation.gradient(start, span(), &loss)?);
        Ok(())
    };
    let running = Loss::integral("loss");
    let mut integral = || {
        black_box(simulation.gradient(start, span(), &running)?);
        Ok(())
    };
    let calls: [&mut dyn FnMut() -> _; 3] = [&mut run, &mut gradient, &mut integral];
    tell(name, model.parameters(), least(calls)?);
    Ok(())
}

fn tell(name: &str, parameters: usize, [of_run, of_gradient, of_integral]: [Duration; 3]) {
    let micros = |time: Duration| time.as_secs_f64() * 1e6 / f64::from(STEPS);
    println!(
        "{name:6} {parameters:5} parameters: {:7.2} µs per step of a run, {:7.2} of a gradient of the end ({:.1} times), of an integral {:.1} times",
        micros(of_run),
        micros(of_gradient),
        micros(of_gradient) / micros(of_run),
        micros(of_integral) / micros(of_run)
    );
}

#[cfg(feature = "sparse")]
fn compare_row(n: usize) -> Result<(), Failure> {
    use tfe::family::{Loss, Model as _};
    let row = Row {
        n,
        m: 1.0,
        b: 0.5,
        k: (0..n - 1).map(|a| 1.0 + 0.1 * (a as f64).sin()).collect(),
    };
    let q: Vec<f64> = (0..n).map(|a| (a as f64).sin()).collect();
    let start = row.state(q, vec![0.0; n]);
    let simulation = Simulation::new(&row).step(STEP);
    let span = || 0.0..STEP * f64::from(STEPS);
    let loss: Loss = Loss::of_end(|q, _, _| 0.5 * q[0] * q[0]);
    let mut run = || {
        black_box(simulation.run(start.clone(), span())?);
        Ok(())
    };
    let mut gradient = || {
        black_box(simulation.gradient(start.clone(), span(), &loss)?);
        Ok(())
    };
    let running: Loss = Loss::integral("loss");
    let mut integral = || {
        black_box(simulation.gradient(start.clone(), span(), &running)?);
        Ok(())
    };
    let calls: [&mut dyn FnMut() -> _; 3] = [&mut run, &mut gradient, &mut integral];
    tell("row", row.parameters(), least(calls)?);
    Ok(())
}

fn main() -> Result<(), Failure> {
    let swing = |a: usize| (a as f64).sin();
    let chain = Chain {
        m: [1.0; 12],
        k: std::array::from_fn(|a| 1.0 + 0.1 * swing(a)),
        c: [0.05; 12],
    };
    let still = [0.0; 12];
    compare(
        "chain",
        &chain,
        chain.state(std::array::from_fn(swing), still),
    )?;
    let net = Net {
        a: 0.1,
        k: std::array::from_fn(|pair| 0.01 + 0.001 * swing(pair)),
    };
    let still = [0.0; 32];
    compare("net", &net, net.state(std::array::from_fn(swing), still))?;
    #[cfg(feature = "sparse")]
    for sites in [100, 1001, 10_001] {
        compare_row(sites)?;
    }
    Ok(())
}
