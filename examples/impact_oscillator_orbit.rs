//! Periodic orbits of an oscillator that hits a wall, compared with their closed form.
//!
//! ```text
//! x″ + x = F cos ωt ,     x ≤ 0 ,     ẋ⁺ = −e ẋ⁻   at x = 0
//! ```
//!
//! S. W. Shaw and P. J. Holmes (1983) give the motions with one impact in n periods of the forcing. With γ = F/(1 −
//! ω²), T = 2πn/ω, and x = a cos t + b sin t + γ cos(ωt + ψ) from the impact on,
//!
//! ```text
//! b² (cot² T/2 + ((1 − e)/((1 + e) ω))²) = γ² ,     a = b cot T/2 ,     γ ω sin ψ = b (1 − e)/(1 + e) ,     ẋ⁻ = −2 b/(1 + e)
//! det M = e² ,     tr M = −2 e cos T + (1 + e) F cos ψ sin T/ẋ⁻
//! ```
//!
//! M is the monodromy matrix, by which a small deviation from the orbit is multiplied in one period; it includes the
//! jump at the impact (saltation matrix), without which its determinant would be 1. The table shows for each orbit the
//! Newton corrections, the speed at the impact and the largest modulus of the multipliers (eigenvalues of M), each with
//! its error, and the stability. An orbit is stable if all multipliers lie within the unit circle: a complex pair
//! always does, with |μ| = e. Where a real one leaves the circle through −1, the period doubles.
//!
//! `cargo run --release --example impact_oscillator_orbit` writes the chart `impact_oscillator_orbit.svg`; give another
//! file name after `--`.

use nalgebra::Complex;
use std::error::Error;
use std::f64::consts::TAU;
use tfe::HybridOrbit;
use tfe::charts::{Axis, Chart, Style};
use tfe::prelude::*;

#[dynamics(
    coordinates(x),
    lagrangian = (dot(x)^2 - x^2)/2 + f*cos(omega*t)*x,
    event(wall) = -x,
)]
struct ImpactOscillator {
    f: f64,
    omega: f64,
}

const RESTITUTION: f64 = 0.8;

/// The closed form: the velocity before the impact, the modulus of the largest multiplier, and a state in the middle of
/// the flight with its time and the period.
struct Exact {
    impact: f64,
    multiplier: f64,
    state: [f64; 2],
    from: f64,
    period: f64,
}

fn exact(f: f64, omega: f64, n: f64) -> Exact {
    let (e, period) = (RESTITUTION, TAU * n / omega);
    let gamma = f / (1.0 - omega * omega);
    let (loss, cot) = ((1.0 - e) / (1.0 + e), 1.0 / (period / 2.0).tan());
    let b = -gamma.abs() / (cot * cot + (loss / omega).powi(2)).sqrt();
    let a = b * cot;
    let psi = (b * loss / (gamma * omega)).atan2(-a / gamma);
    let impact = -2.0 * b / (1.0 + e);
    let trace = -2.0 * e * period.cos() + (1.0 + e) * f * psi.cos() * period.sin() / impact;
    let root = Complex::new(trace * trace / 4.0 - e * e, 0.0).sqrt();
    let (half, angle) = (period / 2.0, omega * period / 2.0 + psi);
    Exact {
        impact,
        multiplier: (trace / 2.0 + root).norm().max((trace / 2.0 - root).norm()),
        state: [
            a * half.cos() + b * half.sin() + gamma * angle.cos(),
            -a * half.sin() + b * half.cos() - gamma * omega * angle.sin(),
        ],
        from: psi / omega + half,
        period,
    }
}

fn orbit(model: &ImpactOscillator, exact: &Exact) -> Result<HybridOrbit<1>, Box<dyn Error>> {
    let simulation =
        Simulation::new(model)
            .element(Mixed::<8>)
            .on("wall", Crossing::Falling, |event| {
                Act::Restart(event.after_impact(RESTITUTION))
            });
    // Newton's method starts with an offset from the exact state.
    let [x, v] = exact.state;
    let orbit = PeriodicOrbit::of_simulation(&simulation)
        .start_time(exact.from)
        .period(exact.period)
        .guess_from(model.state([1.01 * x], [v + 0.02]))
        .solve()?;
    Ok(orbit)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut chart = Chart::new("Orbits of an oscillator that hits a wall")
        .x(Axis::new("x"))
        .y(Axis::new("dx/dt"));
    println!("periods     ω   corrections   speed at the wall     error   largest |μ|     error");
    for (n, omega) in [(1.0, 2.2), (1.0, 2.6), (1.0, 2.8), (2.0, 4.4), (2.0, 4.1)] {
        let model = ImpactOscillator { f: 1.0, omega };
        let exact = exact(model.f, omega, n);
        let orbit = orbit(&model, &exact)?;
        let motion = orbit.motion();
        let impact = motion.events().first().ok_or("it hits the wall")?.v[0];
        let multiplier = orbit.multipliers()[0].norm();
        let off = [impact - exact.impact, multiplier - exact.multiplier].map(f64::abs);
        println!(
            "{n:7}   {omega:3.1}   {:11}   {impact:17.13}   {:7.1e}   {multiplier:11.8}   {:7.1e}   {}",
            orbit.iterations(),
            off[0],
            off[1],
            if orbit.is_stable() {
                "stable"
            } else {
                "unstable"
            }
        );
        assert!(
            off[0] < 1e-9 && off[1] < 1e-9,
            "ω = {omega}: off by {off:?}"
        );
        assert_eq!(orbit.is_stable(), exact.multiplier <= 1.0, "ω = {omega}");
        // From the wall to the wall; the impact closes the curve.
        let hit = motion.events().first().ok_or("it hits the wall")?.t;
        let (from, period) = (exact.from, orbit.period());
        let at = |t: f64| {
            let node = motion.at(t.clamp(from, motion.last().t))?;
            Ok::<_, tfe::AtError>((node.q[0], node.v[0]))
        };
        let times = (1..600).map(|k| hit + period * f64::from(k) / 600.0);
        let times = times.map(|t| if t > from + period { t - period } else { t });
        let mut curve = vec![(0.0, -RESTITUTION * impact)];
        for t in times {
            curve.push(at(t)?);
        }
        curve.extend([(0.0, impact), (0.0, -RESTITUTION * impact)]);
        let name = if n > 1.0 { "2 periods" } else { "1 period" };
        chart = chart.series(format!("{name}, ω = {omega}"), Style::Line, curve);
    }
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| "impact_oscillator_orbit.svg".to_owned());
    chart.save(&path)?;
    println!("\nchart: {path}");
    Ok(())
}
