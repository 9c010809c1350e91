//! Five point masses on five rods, in Cartesian coordinates with constraints and in angles without.

use crate::Outcome;
use crate::runs::{Energy, Run, Scene, distance};
use crate::stroboscope::{Part, Point, Stroboscope};
use tfe::prelude::*;

/// Point masses that hang from each other by rods of equal lengths, the first rod from the origin; SI units.
#[dynamics(
    coordinates(x[5], y[5]),
    lagrangian = sum(i in 0..5, m/2*(dot(x[i])^2 + dot(y[i])^2) - m*g*y[i]),
    constraint(first) = x[0]^2 + y[0]^2 - l^2,
    constraint(rod[i in 1..5]) = (x[i] - x[i-1])^2 + (y[i] - y[i-1])^2 - l^2,
)]
struct Chain {
    m: f64,
    l: f64,
    g: f64,
}

/// The same chain in angles from the downward vertical. Rod j carries the 5 − j masses from its own to the last.
#[dynamics(
    coordinates(theta[5]),
    lagrangian = sum(i in 0..5, sum(j in 0..5,
            m*l^2/2*(5 - max(i, j))*cos(theta[i] - theta[j])*dot(theta[i])*dot(theta[j])))
        + sum(i in 0..5, m*g*l*(5 - i)*cos(theta[i])),
)]
struct AngleChain {
    m: f64,
    l: f64,
    g: f64,
}

const END: f64 = 2.0;
/// At the start the chain is straight, at this angle from the vertical.
const ANGLE: f64 = 1.2;

pub fn scene() -> Outcome {
    let (m, l, g) = (1.0, 0.2, 9.81);
    let model = Chain { m, l, g };
    let angles = AngleChain { m, l, g };
    let start = joints([ANGLE; 5], l);
    let run = Run::of(&model, Mixed::<6>, 0.01, model.state(start, [0.0; 10]), END)?;
    let same = Run::of(
        &angles,
        Mixed::<6>,
        0.01,
        angles.state([ANGLE; 5], [0.0; 5]),
        END,
    )?;
    let error = distance(&run.motion.last().q, &joints(same.motion.last().q, l));
    let row = run.row(
        "five-link chain",
        Energy::Conserved,
        error,
        "the model in angles",
    );

    let points = |q: &[f64; 10]| -> Vec<Point> {
        let masses = (0..5).map(|i| (q[i], q[5 + i]));
        std::iter::once((0.0, 0.0)).chain(masses).collect()
    };
    let shot = |q: &[f64; 10]| {
        let points = points(q);
        let masses = points[1..].iter().map(|point| Part::Mass(*point));
        let masses: Vec<Part> = masses.collect();
        [vec![Part::Line(points)], masses].concat()
    };
    let picture = Stroboscope::new("Five-link chain: the first 1.2 s", "x (m)", "y (m)")
        .ground([Part::Pivot((0.0, 0.0))])
        .path(
            "last mass",
            run.samples_until(1.2, 240)?.iter().map(|q| (q[4], q[9])),
        )
        .shots(run.samples_until(1.2, 18)?.iter().map(shot))
        .to_svg()?;
    let text = "Ten coordinates and five rods, compared with the same chain in five angles with a full mass matrix.";
    let times = format!(
        "The run takes {:.1} ms, and in angles {:.1} ms.",
        1e3 * run.seconds,
        1e3 * same.seconds
    );
    let scene = Scene::new("A chain of five links", text)
        .row(row)
        .paragraph(times);
    Ok(scene.picture(
        "chain",
        picture,
        "Released straight and at rest, at 1.2 rad from the vertical.",
    ))
}

/// x and y of the masses.
fn joints(theta: [f64; 5], l: f64) -> [f64; 10] {
    let mut q = [0.0; 10];
    let (mut x, mut y) = (0.0, 0.0);
    for (i, theta) in theta.into_iter().enumerate() {
        x += l * theta.sin();
        y -= l * theta.cos();
        (q[i], q[5 + i]) = (x, y);
    }
    q
}
