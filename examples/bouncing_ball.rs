//! A bouncing ball, with and without air drag: events that change the state.
//!
//! ```text
//! m ÿ = −m g − c |ẏ| ẏ ,     ẏ⁺ = −e ẏ⁻   at y = 0
//! ```
//!
//! Without drag, the impacts are at t₁, t₁ (1 + 2e), t₁ (1 + 2e + 2e²), … with t₁ = √(2 y₀/g), and the table shows the
//! errors of the times of impact. With drag there is no closed form, so that the last column is the difference from a
//! run with half the step size. The impacts accumulate, without drag at t₁ (1 + e)/(1 − e), which is 5.57 s here, and
//! with drag at 4.216 s; a run beyond that time ends with an error. The drag force is not smooth where the velocity
//! changes its sign: `at_kinks(true)` ends an element there, which keeps the order of accuracy.
//!
//! `cargo run --release --example bouncing_ball` writes the chart `bouncing_ball.svg`; give another file name after
//! `--`.

use std::error::Error;
use tfe::charts::{Axis, Chart, Style};
use tfe::prelude::*;
use tfe::{Event, RunError};

#[dynamics(
    coordinates(y),
    lagrangian = m/2*dot(y)^2 - m*g*y,
    force(y) = -c*abs(dot(y))*dot(y),
    event(impact) = y,
    event(top) = dot(y),
)]
struct Ball {
    m: f64, // kg
    g: f64, // m/s²
    c: f64, // kg/m
}

/// The coefficient of restitution e.
const RESTITUTION: f64 = 0.85;

const HEIGHT: f64 = 1.0;

const END: f64 = 4.0;

fn drop_of(ball: &Ball, step: f64) -> Result<Motion<1>, RunError<1>> {
    Simulation::new(ball)
        .element(Mixed::<6>)
        .step(step)
        .at_kinks(true)
        .on("impact", Crossing::Falling, |event| {
            Act::Restart(event.state_with_velocity([-RESTITUTION * event.v[0]]))
        })
        .on("top", Crossing::Falling, |_| Act::Record)
        .run(ball.state([HEIGHT], [0.0]), 0.0..END)
}

fn impacts(motion: &Motion<1>) -> Vec<&Event<1>> {
    let is_impact = |event: &&Event<1>| event.name == "impact";
    motion.events().iter().filter(is_impact).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let ball = |c: f64| Ball {
        m: 0.05,
        g: 9.81,
        c,
    };
    let (free, dragged, finer) = (
        drop_of(&ball(0.0), 0.05)?,
        drop_of(&ball(0.01), 0.05)?,
        drop_of(&ball(0.01), 0.025)?,
    );
    let first = (2.0 * HEIGHT / 9.81).sqrt();
    let (mut exact, mut hop) = (first, 2.0 * first);
    println!("impact   without drag (s)       error   with drag (s)  difference");
    let in_drag = impacts(&dragged);
    let in_finer = impacts(&finer);
    // The eighth hop ends after 4.17 s without drag; drag makes hops shorter.
    assert_eq!(impacts(&free).len(), 8);
    assert!(in_drag.len() >= 8 && in_finer.len() == in_drag.len());
    for (k, event) in impacts(&free).iter().enumerate() {
        let off = (event.t - exact).abs();
        let (drag, fine) = (in_drag[k].t, in_finer[k].t);
        let apart = (drag - fine).abs();
        println!(
            "{:6}   {:16.13}  {off:10.1e}  {drag:14.11}  {apart:10.1e}",
            k + 1,
            event.t
        );
        assert!(
            off < 1e-13,
            "the time of impact {} has an error of {off:e} s",
            k + 1
        );
        // The element has order ten, and a step of 0.05 s is a fourteenth of the time constant of the drag.
        assert!(
            apart < 1e-9,
            "half the step size changes the time of impact by {apart:e} s"
        );
        hop *= RESTITUTION;
        exact += hop;
    }

    let height = |motion: &Motion<1>| -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
        (0..=900)
            .map(|k| {
                let t = END * f64::from(k) / 900.0;
                Ok((t, motion.at(t)?.q[0]))
            })
            .collect()
    };
    let tops = dragged.events().iter().filter(|event| event.name == "top");
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| "bouncing_ball.svg".to_owned());
    Chart::new("A ball that keeps 85 % of its velocity")
        .x(Axis::new("time (s)"))
        .y(Axis::new("height (m)"))
        .series("without drag", Style::Line, height(&free)?)
        .series("with drag", Style::Line, height(&dragged)?)
        .series(
            "highest points",
            Style::Markers,
            tops.map(|top| (top.t, top.q[0])).collect::<Vec<_>>(),
        )
        .save(&path)?;
    println!("\nchart: {path}");
    Ok(())
}
