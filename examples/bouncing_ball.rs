//! A ball that bounces: events, with and without drag.
//!
//! ```text
//! m ÿ = −m g − c |ẏ| ẏ ,     ẏ⁺ = −e ẏ⁻   at y = 0
//! ```
//!
//! Without drag the k-th impact is at t₁ (1 + 2 e + … + 2 eᵏ), t₁ = √(2 y₀/g): the table shows by how much the impacts of the run are off, with steps longer than the last hops. With drag there
//! is no formula; the impacts of a run of half the step stand for it. The impacts accumulate at t₁ (1 + e)/(1 − e), where the run would end with an error: with drag at 4.216 s. Drag is not smooth where the ball turns, so steps are cut there.
//!
//! `cargo run --release --example bouncing_ball` writes `bouncing_ball.svg`, or the file that is named behind `--`.

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

/// The part of the velocity that an impact leaves.
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
    println!("impact   without drag (s)      off by   with drag (s)      off by");
    let in_drag = impacts(&dragged);
    let in_finer = impacts(&finer);
    // The eighth hop ends after 4.17 s; drag makes hops shorter.
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
        assert!(off < 1e-13, "off by {off:e}");
        // Order ten: a step of 0.05 is a fourteenth of the time in which drag acts.
        assert!(
            apart < 1e-9,
            "steps of half the length move it by {apart:e}"
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
