//! A double pendulum with every element: error against step size, energy error, time per step.
//!
//! Two point masses on massless rods, released at rest from θ = (0.5, −0.3):
//!
//! ```text
//! L = m₁/2 |ẋ₁|² + m₂/2 |ẋ₂|² − g (m₁ y₁ + m₂ y₂),   x₁ = l₁ (sin θ₁, −cos θ₁),   x₂ = x₁ + l₂ (sin θ₂, −cos θ₂)
//! ```
//!
//! The output is: what was derived from the Lagrangian; for each element and step size the error of the angles at t =
//! 10 s, the energy error, the time and the iterations per step; the observed orders, which are checked against the
//! theory; and a chart of errors over step sizes. The reference was computed by extrapolation with two step sizes,
//! which agree to the digits given.

use std::error::Error;
use std::time::Instant;
use tfe::charts::{Axis, Chart, Scale, Style};
use tfe::prelude::*;

#[dynamics(
    coordinates(theta1, theta2),
    let x1 = l1 * sin(theta1),
    let y1 = -l1 * cos(theta1),
    let x2 = x1 + l2 * sin(theta2),
    let y2 = y1 - l2 * cos(theta2),
    lagrangian = m1/2 * (dot(x1)^2 + dot(y1)^2) + m2/2 * (dot(x2)^2 + dot(y2)^2) - g * (m1*y1 + m2*y2),
    output(tip_x) = x2,
    output(tip_y) = y2,
)]
struct DoublePendulum {
    m1: f64, // kg
    m2: f64,
    l1: f64, // m
    l2: f64,
    g: f64, // m/s²
}

const END: f64 = 10.0;
const REFERENCE: [f64; 2] = [-0.1075423326224, 0.3879371483853];
const STEPS: [f64; 7] = [0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002];

struct Curve {
    element: Element,
    /// (step size, error) of each run.
    points: Vec<(f64, f64)>,
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("{}", DoublePendulum::structure());
    let pendulum = DoublePendulum {
        m1: 1.0,
        m2: 1.0,
        l1: 1.0,
        l2: 1.0,
        g: 9.81,
    };
    let start = pendulum.state([0.5, -0.3], [0.0, 0.0]);

    println!(
        "{:<26} {:>6} {:>10} {:>13} {:>10} {:>9}",
        "element", "step", "error", "energy error", "µs/step", "it./step"
    );
    let mut curves = Vec::new();
    for element in elements() {
        let mut points = Vec::new();
        for step in STEPS {
            let simulation = Simulation::new(&pendulum).element(element).step(step);
            let clock = Instant::now();
            let motion = match simulation.run(start, 0.0..END) {
                Ok(motion) => motion,
                // The step is too long for this element: report it and try the next one.
                Err(error) => {
                    println!("{:<26} {step:>6} {error}", element.to_string());
                    continue;
                }
            };
            let steps = (motion.states().len() - 1) as f64;
            let time = clock.elapsed().as_secs_f64() / steps;
            let q = motion.last().q;
            let error = (q[0] - REFERENCE[0]).hypot(q[1] - REFERENCE[1]);
            let iterations = motion.statistics().iterations as f64 / steps;
            println!(
                "{:<26} {step:>6} {error:>10.1e} {:>13.1e} {:>10.2} {iterations:>9.1}",
                element.to_string(),
                motion.energy_error(),
                time * 1e6
            );
            points.push((step, error));
        }
        let (order, claimed) = (order(&points), element.order() as f64);
        println!("{:<26}  order {order:.2}", element.to_string());
        assert!(
            (order - claimed).abs() < 0.5,
            "{element}: order {order:.2}, not {claimed}"
        );
        curves.push(Curve { element, points });
    }

    let best = curves
        .iter()
        .flat_map(|curve| &curve.points)
        .map(|(_, error)| *error)
        .fold(f64::INFINITY, f64::min);
    assert!(
        best < 1e-11,
        "the best error is {best:e}, but the reference has thirteen digits"
    );

    let path = "double_pendulum.svg";
    chart(curves).save(path)?;
    println!("\nchart: {path}");
    Ok(())
}

/// The observed order: the slope of log(error) over log(step size) between the last two errors that are well above the
/// accuracy of the reference; NaN if there are no such two.
fn order(points: &[(f64, f64)]) -> f64 {
    let above = |(_, error): &(f64, f64)| !(*error <= 1e-10);
    let points: Vec<(f64, f64)> = points.iter().copied().filter(above).collect();
    points.last_chunk::<2>().map_or(f64::NAN, |[coarse, fine]| {
        (coarse.1 / fine.1).ln() / (coarse.0 / fine.0).ln()
    })
}

fn elements() -> Vec<Element> {
    vec![
        Primal::<3>.into(),
        Mixed::<2>.into(),
        Mixed::<3>.into(),
        Mixed::<4>.into(),
        Mixed::<6>.into(),
        EnergyConserving::<3>.into(),
        Radau::<4>.into(),
    ]
}

/// Error over step size, both on logarithmic axes: the slope of each curve is the order of its element.
fn chart(curves: Vec<Curve>) -> Chart {
    let chart = Chart::new("Double pendulum, t = 10 s")
        .x(Axis::new("step size (s)").scale(Scale::Logarithmic))
        .y(Axis::new("error of the angles (rad)").scale(Scale::Logarithmic));
    curves.into_iter().fold(chart, |chart, curve| {
        let name = curve.element.to_string();
        chart.series(name, Style::LineWithMarkers, curve.points)
    })
}
