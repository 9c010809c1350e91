//! The step of a linear model costs as much as one matrix–vector product: 20 masses in a row, a matrix of 40 × 40.
//!
//! `cargo bench --bench linear` prints both times and their ratio.

use std::hint::black_box;
use std::time::Instant;
use tfe::prelude::*;
use tfe::runtime::step::{Control, Stepper};

/// A row of masses between walls.
#[dynamics(
    coordinates(q[20]),
    lagrangian = sum(i in 0..20, dot(q[i])^2/2) - k/2*(q[0]^2 + q[19]^2) - sum(i in 0..19, k/2*(q[i+1] - q[i])^2),
)]
struct Row {
    k: f64,
}

const SIZE: usize = 40;
const STEPS: u32 = 100_000;

/// y ← y + D y, the product by columns, which compilers vectorise best.
fn product(columns: &[[f64; SIZE]; SIZE], y: &mut [f64; SIZE]) {
    let mut increment = [0.0; SIZE];
    for (column, factor) in columns.iter().zip(y.iter()) {
        for a in 0..SIZE {
            increment[a] += column[a] * factor;
        }
    }
    for a in 0..SIZE {
        y[a] += increment[a];
    }
}

/// The same with four columns at a time.
fn blocked(columns: &[[f64; SIZE]; SIZE], y: &mut [f64; SIZE]) {
    let mut increment = [0.0; SIZE];
    for ([c0, c1, c2, c3], f) in columns.as_chunks().0.iter().zip(y.as_chunks::<4>().0) {
        for a in 0..SIZE {
            increment[a] += (c0[a] * f[0] + c1[a] * f[1]) + (c2[a] * f[2] + c3[a] * f[3]);
        }
    }
    for a in 0..SIZE {
        y[a] += increment[a];
    }
}

/// The smallest time of several runs, in nanoseconds per step.
fn best(mut run: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS)
    };
    (0..7).map(time).fold(f64::INFINITY, f64::min)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let row = Row { k: 1.0 };
    let mut q = [0.0; 20];
    q[3] = 1.0;
    let start = row.state(q, [0.0; 20]);
    let h = 0.05;

    let matrix = stability::transition_matrix(&row, Mixed::<4>, &start, 0.0, h)?;
    let mut columns = [[0.0; SIZE]; SIZE];
    for (column, entries) in columns.iter_mut().enumerate() {
        for (line, entry) in entries.iter_mut().enumerate() {
            *entry = matrix[(line, column)] - f64::from(u8::from(line == column));
        }
    }
    let mut y = [0.0; SIZE];
    y[20 + 3] = 1.0;
    let plain = best(|| {
        for _ in 0..STEPS {
            product(black_box(&columns), &mut y);
        }
        black_box(&y);
    });
    let four = best(|| {
        for _ in 0..STEPS {
            blocked(black_box(&columns), &mut y);
        }
        black_box(&y);
    });

    let mut stepper = Stepper::new(&row, Mixed::<4>.into(), Control::default())?.ends_only();
    let mut state = start;
    let mut failed = None;
    let stepped = best(|| {
        for _ in 0..STEPS {
            if let Err(error) = stepper.advance(0.0, h, &mut state, &[]) {
                failed = Some(error);
            }
        }
        black_box(&state);
    });
    if let Some(error) = failed {
        return Err(error.into());
    }
    println!("product of a 40 x 40 matrix and a vector   {plain:8.1} ns");
    println!("the same, four columns at a time           {four:8.1} ns");
    println!("step of the model, compensated summation   {stepped:8.1} ns");
    println!(
        "ratio of the step to the faster product    {:8.2}",
        stepped / plain.min(four)
    );
    Ok(())
}
