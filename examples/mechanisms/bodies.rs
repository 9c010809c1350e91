//! A rigid body in space, described by a unit quaternion.

use crate::Outcome;
use crate::runs::{Energy, Run, Scene};
use crate::stroboscope::{Part, Stroboscope, seen};
use tfe::prelude::*;

/// A symmetric top with a fixed point; consistent units.
///
/// The kinetic energy does not depend on the rate of change of |e|, so that the mass matrix of the four coordinates is
/// singular. The element solves for the velocities together with the constraint and needs no regular mass matrix.
#[dynamics(
    coordinates(e[4]),
    let w = body_rate(e),
    let axis = rotate(e, [0, 0, 1]),
    lagrangian = j1/2*(w[0]^2 + w[1]^2) + j3/2*w[2]^2 - mgd*axis[2],
    constraint(unit) = inner(e, e) - 1,
    output(tip_x) = axis[0],
    output(tip_y) = axis[1],
    output(tip_z) = axis[2],
)]
struct Top {
    j1: f64,
    j3: f64,
    mgd: f64,
}

/// The inclination at the start.
const TILT: f64 = 0.5;
/// The rate of spin about the axis of the body.
const SPIN: f64 = 6.0;

pub fn top() -> Outcome {
    let model = Top {
        j1: 1.0,
        j3: 0.5,
        mgd: 1.0,
    };
    // A rotation by TILT about x; de/dt = ½ e∘(0, 0, 0, SPIN).
    let (sin, cos) = (TILT / 2.0).sin_cos();
    let start = model.state(
        [cos, sin, 0.0, 0.0],
        [0.0, 0.0, -SPIN * sin / 2.0, SPIN * cos / 2.0],
    );
    let short = Run::of(&model, Mixed::<6>, 0.05, start, 2.0)?;
    // The reference at t = 2, with 16 digits.
    let reference = [
        0.939_715_778_002_366_2,
        0.133_430_668_539_187_67,
        0.249_080_684_593_773_03,
        -0.192_585_892_081_664_46,
    ];
    let row = short.row(
        "quaternion top",
        Energy::Conserved,
        short.error(&reference),
        "16 digits",
    );
    let long = Run::of(&model, Mixed::<6>, 0.05, start, 12.0)?;
    let tip = |e: &[f64; 4]| seen(axis(e));
    let foot = seen([0.0; 3]);
    let picture = Stroboscope::new(
        "Heavy top: its axis",
        "across (consistent units)",
        "up (consistent units)",
    )
    .ground([Part::Pivot(foot)])
    .path("tip", long.samples(900)?.iter().map(tip))
    .shots(
        long.samples(61)?
            .iter()
            .map(|e| vec![Part::rod(foot, tip(e)), Part::Mass(tip(e))]),
    )
    .to_svg()?;
    let text = "Four coordinates with |e|² = 1. Released at an inclination of 0.5 with nothing but its spin, the top falls, rises and \
                precesses: the path of its tip has cusps.";
    Ok(Scene::new("A heavy top", text).row(row).picture(
        "top",
        picture,
        "Seen from the right, the front and above; consistent units, 12 units of time.",
    ))
}

/// The axis of the body in space.
fn axis([a, b, c, d]: &[f64; 4]) -> [f64; 3] {
    [
        2.0 * (b * d + a * c),
        2.0 * (c * d - a * b),
        a * a - b * b - c * c + d * d,
    ]
}
