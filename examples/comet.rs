//! Halley's comet through its perihelion, with steps that become shorter as it approaches the Sun (time
//! transformation).
//!
//! H = p²/2 − μ/r per unit of mass, in astronomical units and years: μ = 4π². The orbit is that of 1P/Halley, rounded:
//! semi-major axis 17.834 au, eccentricity 0.96714. Its distance from the Sun is 0.59 au at perihelion, and 35.1 au at
//! aphelion, where the run begins. Steps are equal in a fictitious time τ with dt = r^k dτ. For k = 0, τ is the time
//! itself, so that steps are equal in t; with k = 3/2 they are proportional to the period of the circular orbit through
//! the current position.
//!
//! The table shows the error of the position after one revolution against the Kepler ellipse at the time reached, for k
//! = 0 (column `dt`), 1 (`r dτ`) and 3/2 (`r^1.5 dτ`). At equal numbers of steps, the transformed runs are more than a
//! thousand times as accurate as equal steps in t (800 steps); “failed” means that a step was too long to be solved.

use std::error::Error;
use std::f64::consts::{PI, TAU};

use tfe::prelude::*;

const A: f64 = 17.834;
const E: f64 = 0.96714;
const MU: f64 = 4.0 * PI * PI;

#[dynamics(
    coordinates(x, y),
    momenta(px, py),
    let r = sqrt(x^2 + y^2),
    hamiltonian = (px^2 + py^2)/2 - mu/r,
    time_transformation = r^k,
)]
struct Comet {
    mu: f64,
    k: f64,
}

/// The position on the ellipse at a time since aphelion; Kepler's equation M = u − e sin u is solved by bisection.
fn position(t: f64) -> [f64; 2] {
    let mean = (t * (MU / A.powi(3)).sqrt() + PI).rem_euclid(TAU);
    let (mut low, mut high) = (0.0, TAU);
    for _ in 0..60 {
        let u: f64 = 0.5 * (low + high);
        if u - E * u.sin() < mean {
            low = u;
        } else {
            high = u;
        }
    }
    let (sin, cos) = (0.5 * (low + high)).sin_cos();
    [A * (cos - E), A * (1.0 - E * E).sqrt() * sin]
}

/// The length of one revolution in τ, ∫ dt/r^k with dt = √(a/μ) r du. For this periodic integrand the midpoint rule
/// converges exponentially.
fn revolution(k: f64) -> f64 {
    let points = 2000;
    let h = TAU / f64::from(points);
    let rate = |i: i32| (A * (1.0 - E * (h * (f64::from(i) + 0.5)).cos())).powf(1.0 - k);
    (A / MU).sqrt() * h * (0..points).map(rate).sum::<f64>()
}

/// The error of the position after one revolution, in au; `None` if a step cannot be solved.
fn error(k: f64, steps: u32) -> Option<f64> {
    let comet = Comet { mu: MU, k };
    let speed = (MU / A * (1.0 - E) / (1.0 + E)).sqrt();
    let start = comet.state([-A * (1.0 + E), 0.0], [0.0, -speed]);
    let span = revolution(k);
    let simulation = Simulation::new(&comet)
        .element(Mixed::<5>)
        .step(span / f64::from(steps));
    let motion = simulation.run(start, 0.0..span).ok()?;
    let [x, y, t] = motion.last().q;
    let exact = position(t);
    Some((x - exact[0]).hypot(y - exact[1]))
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("steps        dt      r dτ  r^1.5 dτ   (error in au)");
    let mut last = [None; 3];
    for steps in [25, 50, 100, 200, 400, 800] {
        last = [0.0, 1.0, 1.5].map(|k| error(k, steps));
        let shown =
            last.map(|error| error.map_or("failed".to_owned(), |error| format!("{error:.1e}")));
        println!(
            "{steps:5}  {:>8}  {:>8}  {:>8}",
            shown[0], shown[1], shown[2]
        );
    }
    let [plain, in_radius, in_period] = last.map(|error| error.unwrap_or(f64::INFINITY));
    assert!(in_radius < 1e-3 * plain && in_period < 1e-3 * plain);
    Ok(())
}
