//! Which model is just good enough: pendulums by amplitude, a beam by modes.

use std::error::Error;
use std::time::Duration;
use tfe::charts::Section;
use tfe::fidelity::Ladder;
use tfe::prelude::*;

/// A pendulum of one metre by its linear equation.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 - 9.81*theta^2/2,
    output(x) = sin(theta), output(y) = -cos(theta),
)]
struct Linear;

/// One power of the angle more in the force.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 - 9.81*(theta^2/2 - theta^4/24),
    output(x) = sin(theta), output(y) = -cos(theta),
)]
struct Cubic;

/// As it is.
#[dynamics(
    coordinates(theta),
    lagrangian = dot(theta)^2/2 + 9.81*cos(theta),
    output(x) = sin(theta), output(y) = -cos(theta),
)]
struct Full;

/// A slender beam of unit length, mass and stiffness, clamped at one end, in n parts of length 1/n: w[i] at x = (i + 1)/n. Central differences for its
/// curvature, of which half a part lies at the clamp, where the slope is zero, and none at the free end, which has half the mass of the others.
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

/// One section a ladder, each with its chart and its table of choices.
pub fn sections() -> Result<Vec<Section>, Box<dyn Error>> {
    let mut ladders = Vec::new();
    for degrees in [5.0, 45.0, 120.0] {
        ladders.push(pendulum(degrees)?);
    }
    // What is a linear pendulum at 5°, to a tenth, is none at 120°, and nobody's but the full one to a millionth.
    let rung = |at: usize, accuracy| ladders[at].cheapest(accuracy).map(|one| &*one.rung);
    assert_eq!([0, 1, 2].map(|at| rung(at, 1e-6)), [Some("full"); 3]);
    assert_ne!(rung(0, 1e-1), Some("full"));
    assert_eq!(rung(2, 1e-1), Some("full"));
    ladders.push(beam()?);
    let mut sections = Vec::new();
    for ladder in &ladders {
        println!("\n{}\n{ladder}", ladder.title());
        sections.push(ladder.section()?);
    }
    Ok(sections)
}

fn pendulum(degrees: f64) -> Result<Ladder, Box<dyn Error>> {
    let a = degrees.to_radians();
    let ladder = Fidelity::new(0.0..20.0)
        .title(format!("A pendulum from {degrees}°, over 20 s"))
        .rung("linear", &Linear, Linear.state([a], [0.0]))
        .rung("cubic", &Cubic, Cubic.state([a], [0.0]))
        .rung("full", &Full, Full.state([a], [0.0]))
        .repeat_for(Duration::from_millis(5));
    Ok(ladder.run()?)
}

/// Drawn aside at its tip, and let go.
fn beam() -> Result<Ladder, Box<dyn Error>> {
    const PARTS: usize = 40;
    let beam = Beam::new(PARTS);
    let one: Modal<'_, Beam, 1> = Modal::of(&beam)?;
    let two: Modal<'_, Beam, 2> = Modal::of(&beam)?;
    let five: Modal<'_, Beam, 5> = Modal::of(&beam)?;
    let twenty: Modal<'_, Beam, 20> = Modal::of(&beam)?;
    // cos βL cosh βL = −1, in differences of second order.
    let exact = 3.516_015_268_5;
    let lowest = one.frequencies()[0];
    println!(
        "\nbeam of {PARTS} parts: lowest frequency {lowest:.6}, of the continuous beam {exact:.6}"
    );
    assert!((lowest / exact - 1.0).abs() < 1.0 / (PARTS * PARTS) as f64);
    let x = (1..=PARTS).map(|i| i as f64 / PARTS as f64);
    let drawn: Vec<f64> = x.map(|x| 0.005 * (3.0 * x * x - x.powi(3))).collect();
    let start = beam.state(drawn, vec![0.0; PARTS]);
    let ladder = Fidelity::new(0.0..4.0)
        .title("A beam plucked at its tip, by modes")
        .rung("1 mode", &one, one.reduce(&start))
        .rung("2 modes", &two, two.reduce(&start))
        .rung("5 modes", &five, five.reduce(&start))
        .rung("20 modes", &twenty, twenty.reduce(&start))
        .rung("full", &beam, start)
        .repeat_for(Duration::from_millis(5));
    Ok(ladder.run()?)
}
