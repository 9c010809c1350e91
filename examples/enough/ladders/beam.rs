//! A beam reduced to its lowest modes.

use super::{ladder, served, shown};
use std::error::Error;
use tfe::charts::Section;
use tfe::prelude::*;

/// A slender beam of unit length, mass and stiffness, clamped at one end, in n parts of length 1/n: w[i] at x = (i +
/// 1)/n. Its curvature is taken by central differences. At the clamp, where the slope is zero, it counts for half a
/// part; at the free end, where the mass is half of the others, it is zero.
///
/// ```text
/// V = k/2 (½ (2 w₁)² + Σ (w_{i+1} − 2 w_i + w_{i−1})²) ,     k = n³ ,     m = 1/n
/// ```
#[dynamics(
    coordinates(w[n]),
    lagrangian = sum(i in 0..n, m/2*dot(w[i])^2) - m/4*dot(w[n-1])^2
        - k*w[0]^2 - k/2*(w[1] - 2*w[0])^2 - sum(i in 0..n-2, k/2*(w[i+2] - 2*w[i+1] + w[i])^2),
    output(tip) = w[n-1], output(middle) = w[half-1],
)]
struct Beam {
    n: usize,
    half: usize,
    m: f64,
    k: f64,
}

impl Beam {
    fn new(n: usize) -> Self {
        let parts = n as f64;
        Self {
            n,
            half: n / 2,
            m: 1.0 / parts,
            k: parts.powi(3),
        }
    }
}

/// The initial state: the shape under a force at the tip, released at rest.
pub fn section() -> Result<Section, Box<dyn Error>> {
    const PARTS: usize = 40;
    let beam = Beam::new(PARTS);
    let one: Modal<'_, Beam, 1> = Modal::of(&beam)?;
    let two: Modal<'_, Beam, 2> = Modal::of(&beam)?;
    let five: Modal<'_, Beam, 5> = Modal::of(&beam)?;
    let twenty: Modal<'_, Beam, 20> = Modal::of(&beam)?;
    // The first root of cos βL cosh βL = −1, squared; the error of the differences is of second order in the length of
    // a part.
    let exact = 3.516_015_268_5;
    let lowest = one.frequencies()[0];
    println!(
        "\nbeam of {PARTS} parts: lowest frequency {lowest:.6}, of the continuous beam {exact:.6}"
    );
    assert!((lowest / exact - 1.0).abs() < 1.0 / (PARTS * PARTS) as f64);
    let x = (1..=PARTS).map(|i| i as f64 / PARTS as f64);
    let drawn: Vec<f64> = x.map(|x| 0.005 * (3.0 * x * x - x.powi(3))).collect();
    let start = beam.state(drawn, vec![0.0; PARTS]);
    let end = if cfg!(debug_assertions) { 0.2 } else { 4.0 };
    let ladder = ladder("A beam released from a tip load, by modes", end)
        .rung("1 mode", &one, one.reduce(&start))
        .rung("2 modes", &two, two.reduce(&start))
        .rung("5 modes", &five, five.reduce(&start))
        .rung("20 modes", &twenty, twenty.reduce(&start))
        .rung("full", &beam, start)
        .run()?;
    let seen = format!(
        "Result: the fewer modes, the longer the steps may be; the cheapest model is {}.",
        served(&ladder)
    );
    shown(&ladder, &seen)
}
