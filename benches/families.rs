//! Models of run-time length: the generated evaluation of forces compared with a loop written by hand, and the time of
//! a step over the length.

use std::hint::black_box;
use std::time::Instant;
use tfe::family::{self, Gradient, Model as _};
use tfe::prelude::*;
use tfe::runtime::step::Control;

/// The FPUT-α chain, with quadratic forces.
#[dynamics(
    coordinates(q[n]),
    lagrangian = sum(i in 0..n, m/2*dot(q[i])^2) - sum(i in 0..n-1, k/2*(q[i+1]-q[i])^2 + a/3*(q[i+1]-q[i])^3),
)]
struct Chain {
    n: usize,
    m: f64,
    k: f64,
    a: f64,
}

/// The same forces written by hand: the force of each spring is computed once and kept for the next body.
fn by_hand(chain: &Chain, q: &[f64], force: &mut [f64]) {
    let n = chain.n;
    let (q, force) = (&q[..n], &mut force[..n]);
    let mut left = 0.0;
    for i in 0..n - 1 {
        let stretch = q[i + 1] - q[i];
        let right = stretch * (chain.k + chain.a * stretch);
        force[i] = right - left;
        left = right;
    }
    force[n - 1] = -left;
}

/// The same without keeping it: the force on each body is computed from two springs, a loop that compilers vectorise.
fn by_hand_twice(chain: &Chain, q: &[f64], force: &mut [f64]) {
    let n = chain.n;
    let (q, force) = (&q[..n], &mut force[..n]);
    let spring = |stretch: f64| stretch * (chain.k + chain.a * stretch);
    force[0] = spring(q[1] - q[0]);
    for i in 1..n - 1 {
        force[i] = spring(q[i + 1] - q[i]) - spring(q[i] - q[i - 1]);
    }
    force[n - 1] = -spring(q[n - 1] - q[n - 2]);
}

/// The smallest of several times of one call, in nanoseconds.
fn nanoseconds(mut call: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..60 {
        let start = Instant::now();
        for _ in 0..300 {
            call();
        }
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / 300.0);
    }
    best
}

/// Adds up absolute differences, eight at a time.
fn read(force: &[f64], expected: &[f64], off: &mut [f64; 8]) {
    let pairs = force.chunks_exact(8).zip(expected.chunks_exact(8));
    for (force, expected) in pairs {
        for (k, off) in off.iter_mut().enumerate() {
            *off += (force[k] - expected[k]).abs();
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let chain = Chain {
        n: 1024,
        m: 1.0,
        k: 1.0,
        a: 0.25,
    };
    let q: Vec<f64> = (0..chain.n).map(|i| (0.1 * i as f64).sin()).collect();
    let mut force = vec![0.0; chain.n];
    let mut expected = vec![0.0; chain.n];
    by_hand(&chain, &q, &mut expected);
    // The result is read, as it is in a step.
    let mut off = [0.0; 8];
    let generated = nanoseconds(|| {
        let first = Gradient {
            z: &mut [],
            q: &mut force,
            force: &mut [],
        };
        black_box(&chain).forces_inline(0.0, black_box(&q), black_box(&q), first);
        black_box(&force);
        // The generated code writes all entries, so that they need not be cleared before.
        const { assert!(Chain::ASSIGNS) };
        read(&force, &expected, &mut off);
    });
    let hand = nanoseconds(|| {
        by_hand(black_box(&chain), black_box(&q), &mut force);
        black_box(&force);
        read(&force, &expected, &mut off);
    });
    let twice = nanoseconds(|| {
        by_hand_twice(black_box(&chain), black_box(&q), &mut force);
        black_box(&force);
        read(&force, &expected, &mut off);
    });
    assert!(off.iter().sum::<f64>() < 1e-8);
    println!(
        "forces of FPUT, n = 1024: generated {generated:.0} ns, by hand {hand:.0} ns (ratio {:.2}), every spring twice {twice:.0} ns",
        generated / hand
    );
    println!(
        "{:>8} {:>12} {:>14} {:>12}",
        "n", "us per step", "ns per site", "iterations"
    );
    for n in [10, 100, 1000, 10_000, 100_000] {
        let chain = Chain { n, ..chain };
        let q: Vec<f64> = (0..n).map(|i| (0.1 * i as f64).sin()).collect();
        let mut state = chain.state(q, vec![0.0; n]);
        let mut stepper = family::Stepper::new(&chain, Mixed::<4>.into(), Control::default())?;
        for step in 0..5 {
            stepper.advance(0.1 * f64::from(step), 0.1, &mut state)?;
        }
        let steps = (2_000_000 / n).clamp(20, 20_000) as u32;
        let before = *stepper.statistics();
        let start = Instant::now();
        for step in 0..steps {
            stepper.advance(0.1 * f64::from(step), 0.1, &mut state)?;
        }
        let time = start.elapsed().as_secs_f64() * 1e6 / f64::from(steps);
        let iterations = stepper.statistics().iterations - before.iterations;
        let iterations = iterations as f64 / f64::from(steps);
        println!(
            "{n:>8} {time:>12.2} {:>14.2} {iterations:>12.2}",
            1e3 * time / n as f64
        );
    }
    Ok(())
}
