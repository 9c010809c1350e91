//! A pendulum with small and large amplitudes: the linear, the cubic and the full model.

use super::{chosen, elements, ladder, model_error, served, shown};
use std::error::Error;
use tfe::charts::Section;
use tfe::fidelity::Ladder;
use tfe::prelude::*;

/// A pendulum of one metre, and the polynomial approximations of its Lagrangian.
#[dynamics(
    coordinates(theta),
    lagrangian = l^2*dot(theta)^2/2 + g*l*cos(theta),
    output(x) = l*sin(theta), output(y) = -l*cos(theta),
    model(Linear, truncated(2)),
    model(Cubic, truncated(4)),
)]
struct Pendulum {
    l: f64,
    g: f64,
}

/// A section for each of three amplitudes.
pub fn sections() -> Result<Vec<Section>, Box<dyn Error>> {
    let degrees = [5.0, 45.0, 120.0];
    let mut ladders = Vec::new();
    for degrees in degrees {
        ladders.push(swing(degrees)?);
    }
    // From 5° the linear model is accurate to a tenth; from 120° only the full one is; and none but the full one
    // reaches a millionth.
    let rung = |at: usize, accuracy| chosen(&ladders[at], accuracy);
    assert_eq!([0, 1, 2].map(|at| rung(at, 1e-6)), [Some("full"); 3]);
    assert_ne!(rung(0, 1e-1), Some("full"));
    assert_eq!(rung(2, 1e-1), Some("full"));
    let sections = ladders.iter().zip(degrees);
    sections
        .map(|(ladder, degrees)| {
            let [linear, cubic] = [0, 1].map(|rung: usize| model_error(&ladder.rungs()[rung]));
            let seen = format!(
                "Result: from {degrees}° the linear model has an error of {linear} and the cubic one of {cubic}; the cheapest model is {}.",
                served(ladder)
            );
            shown(ladder, &seen)
        })
        .collect()
}

fn swing(degrees: f64) -> Result<Ladder, Box<dyn Error>> {
    let a = f64::to_radians(degrees);
    let full = Pendulum { l: 1.0, g: 9.81 };
    let (linear, cubic) = (Linear::of(&full), Cubic::of(&full));
    let ladder = ladder(format!("A pendulum from {degrees}°, over 20 s"), 20.0)
        .elements(elements())
        .rung("linear", &linear, linear.state([a], [0.0]))
        .rung("cubic", &cubic, cubic.state([a], [0.0]))
        .rung("full", &full, full.state([a], [0.0]));
    Ok(ladder.run()?)
}
