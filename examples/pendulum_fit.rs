//! Identification of a filmed pendulum: its length and two coefficients of friction from noisy angles.
//!
//! ```text
//! m l² θ̈ = −m g l sin θ − c θ̇ − d l³ |θ̇| θ̇
//! ```
//!
//! Large swings decay by the drag of the air, d, and small ones by the friction in the bearing, c; a film that shows
//! both determines both coefficients. The angles are computed every 40 ms from a motion with known parameters, and
//! noise with a standard deviation of 0.01 rad is added. The initial angle and momentum are not known either. The table
//! shows the true and the fitted values, and the error in units of the standard deviation that the fit estimates: it
//! should rarely exceed ±2.
//!
//! `cargo run --release --example pendulum_fit` writes the chart `pendulum_fit.svg`; give another file name after `--`.

use std::error::Error;
use tfe::charts::{Axis, Chart, Style};
use tfe::prelude::*;

#[dynamics(
    coordinates(theta),
    lagrangian = m*l^2/2*dot(theta)^2 + m*g*l*cos(theta),
    force(theta) = -c*dot(theta) - d*l^3*abs(dot(theta))*dot(theta),
    output(angle) = theta,
)]
struct Pendulum {
    m: f64, // kg
    l: f64, // m
    g: f64, // m/s²
    c: f64, // N m s
    d: f64, // kg/m
}

const STEP: f64 = 0.04;
const PICTURES: u32 = 500;
const NOISE: f64 = 0.01;

/// Random numbers of the standard normal distribution, the same in every run of the program.
fn noise() -> impl Iterator<Item = f64> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    // The sum of twelve uniform random numbers has variance one.
    std::iter::repeat_with(move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
}

fn main() -> Result<(), Box<dyn Error>> {
    let truth = Pendulum {
        m: 0.2,
        l: 0.75,
        g: 9.81,
        c: 0.004,
        d: 0.02,
    };
    let times: Vec<f64> = (0..PICTURES).map(|k| STEP * f64::from(k)).collect();
    let end = times[times.len() - 1];
    let run =
        |pendulum: &Pendulum, start| Simulation::new(pendulum).step(STEP).run(start, 0.0..end);
    let start = truth.state([1.9], [0.0]);
    let motion = run(&truth, start)?;
    let filmed: Vec<f64> = motion
        .states()
        .iter()
        .zip(noise())
        .map(|(node, noise)| node.q[0] + NOISE * noise)
        .collect();

    let guess = Pendulum {
        l: 0.8,
        c: 0.0,
        d: 0.0,
        ..truth
    };
    let release = guess.state([filmed[0]], [0.0]);
    let fitted = |guess: &Pendulum, release: State<1>, pictures: usize| {
        Fit::new(guess)
            .start_near(release, 0.0)
            .step(STEP)
            .parameters(["l", "c", "d"])
            .bounds("l", 0.1..)
            .bounds("c", 0.0..)
            .bounds("d", 0.0..)
            .output_within("angle", &times[..pictures], &filmed[..pictures], NOISE)
            .solve()
    };
    // After twenty seconds, the motion of the first guess is half a swing behind, which is too far for least squares to
    // converge. So the first three seconds are fitted first, for a better guess.
    let early = fitted(&guess, release, 75)?;
    let fit = fitted(early.model(), early.start(), filmed.len())?;
    println!("{early}\n\n{fit}\n");
    println!("          truth       found   error (standard deviations)");
    for name in ["l", "c", "d"] {
        let index = truth.find_parameter(name).ok_or("a parameter")?;
        let (exact, found) = (truth.parameter(index), fit.value(name).ok_or("found")?);
        let off = (found - exact) / fit.deviation(name).ok_or("found")?;
        println!("{name}  {exact:12.5}  {found:10.5}  {off:+.2}");
        assert!(
            off.abs() < 4.0,
            "`{name}` has an error of {off} standard deviations"
        );
    }

    let first = run(&guess, release)?;
    let curve = |motion: &Motion<1>| -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
        (0..=1500)
            .map(|k| {
                let t = end * f64::from(k) / 1500.0;
                Ok((t, motion.at(t)?.q[0]))
            })
            .collect()
    };
    let points = times.iter().copied().zip(filmed.iter().copied());
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| "pendulum_fit.svg".to_owned());
    Chart::new("A filmed pendulum: length, bearing and air from 500 angles")
        .x(Axis::new("time (s)"))
        .y(Axis::new("angle (rad)"))
        .series("first guess", Style::Reference, curve(&first)?)
        .series("filmed", Style::Markers, points.collect::<Vec<_>>())
        .series("fitted", Style::Line, curve(fit.motion())?)
        .save(&path)?;
    println!("\nchart: {path}");
    Ok(())
}
