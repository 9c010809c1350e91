//! A pendulum with a rigid rod, and a bead on a wire.

use crate::Outcome;
use crate::runs::{Energy, Run, Scene};
use crate::stroboscope::{Part, Point, Stroboscope};
use tfe::charts::{Chart, Style};
use tfe::prelude::*;

/// A point mass on a rigid massless rod, in Cartesian coordinates, y upwards; SI units.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(rod) = x^2 + y^2 - l^2,
)]
struct RodPendulum {
    m: f64,
    l: f64,
    g: f64,
}

pub fn pendulum() -> Outcome {
    let model = RodPendulum {
        m: 1.0,
        l: 1.0,
        g: 9.81,
    };
    let start = model.state([1.0, 0.0], [0.0, 0.0]);
    // The reference at t = 5 s, by elliptic functions.
    let reference = [0.942_305_435_043_757_3, -0.334_754_338_414_000_6];
    let run = Run::of(&model, Mixed::<6>, 0.05, start, 5.0)?;
    let error = run.error(&reference);
    let two = Run::of(&model, Primal::<2>.lobatto(), 0.002, start, 5.0)?;
    let against = "elliptic functions";
    let rows = [
        run.row("pendulum with a rod", Energy::Conserved, error, against),
        two.row(
            "pendulum with a rod",
            Energy::Conserved,
            two.error(&reference),
            against,
        ),
    ];

    // Released at the height of the pivot: v² = −2gy, and the tension of the rod is m v²/l − mg y/l = −3mg y/l.
    let nodes = run.motion.states();
    let tension = |y: f64| -3.0 * model.m * model.g * y / model.l;
    let lambda = run
        .motion
        .reactions()
        .column("rod")
        .ok_or("no reaction of the rod")?;
    // The force λ ∂φ/∂q = 2λ (x, y) points towards the pivot.
    let pull: Vec<(f64, f64)> = nodes
        .iter()
        .zip(&lambda)
        .map(|(node, lambda)| (node.t, -2.0 * lambda * model.l))
        .collect();
    let worst = nodes
        .iter()
        .zip(&pull)
        .map(|(node, (_, pull))| (pull - tension(node.q[1])).abs());
    let worst = worst.max_by(f64::total_cmp).ok_or("no node")?;
    // The tension is a function of the state at the node, so that its error is that of the state: little more than
    // rounding with this step. It is at most 29 N.
    assert!(worst < 1e-9, "the tension has an error of {worst:e} N");
    let exact = run
        .samples(401)?
        .into_iter()
        .enumerate()
        .map(|(k, q)| (5.0 * k as f64 / 400.0, tension(q[1])));
    let chart = Chart::new("Tension of the rod")
        .x("t (s)")
        .y("tension (N)")
        .series("−3mg y/l", Style::Reference, exact)
        .series("−2λl", Style::Markers, pull);

    let at = |q: &[f64; 2]| (q[0], q[1]);
    // Half a period of the swing, 2 K(1/√2) √(l/g).
    let swing = 2.0 * 1.854_074_677_301_372 * (model.l / model.g).sqrt();
    let picture = Stroboscope::new("Pendulum with a rod: the first swing", "x (m)", "y (m)")
        .ground([Part::Pivot((0.0, 0.0))])
        .shots(
            run.samples_until(swing, 17)?
                .iter()
                .map(|q| vec![Part::rod((0.0, 0.0), at(q)), Part::Mass(at(q))]),
        )
        .to_svg()?;
    let scene = Scene::new(
        "A pendulum with a rod",
        "A mass in Cartesian coordinates on a rod, x² + y² = l². The element satisfies the constraint itself at its nodes, not only its second \
         time derivative. Two primal nodes with Lobatto quadrature are the RATTLE method.",
    );
    let [fine, rattle] = rows;
    Ok(scene
        .row(fine)
        .row(rattle)
        .picture("pendulum", picture, "Released at rest from the right, 17 equally spaced times.")
        .picture(
            "pendulum_tension",
            chart.to_svg()?,
            format!("The tension at the nodes, from the multiplier λ; it differs from the closed form by at most {worst:.0e} N."),
        ))
}

/// A bead on a frictionless wire y = x⁴/4; SI units.
#[dynamics(
    coordinates(x, y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y,
    constraint(wire) = y - x^4/4,
)]
struct Bead {
    m: f64,
    g: f64,
}

pub fn bead() -> Outcome {
    let model = Bead { m: 1.0, g: 9.81 };
    let start = model.state([1.2, wire(1.2)], [0.0, 0.0]);
    let run = Run::of(&model, Mixed::<5>, 0.02, start, 2.0)?;
    // The reference at t = 2 s, with twelve digits.
    let error = run.error(&[0.239_289_318_946_371, 0.000_819_659_096_869_522_1]);
    let row = run.row("bead on a wire", Energy::Conserved, error, "12 digits");
    let curve = (0..=200)
        .map(|k| -1.25 + 0.0125 * f64::from(k))
        .map(|x| (x, wire(x)));
    let swing = run.first(|q| q[0] < -1.19).ok_or("no swing")?;
    let bead = |q: &[f64; 2]| -> Point { (q[0], q[1]) };
    let picture = Stroboscope::new("Bead on a wire", "x (m)", "y (m)")
        .path("y = x⁴/4", curve)
        .shots(
            run.samples_until(swing, 24)?
                .iter()
                .map(|q| vec![Part::Mass(bead(q))]),
        )
        .to_svg()?;
    let text =
        "Although the constraint φ = y − x⁴/4 is not quadratic, it is satisfied at all nodes.";
    Ok(Scene::new("A bead on a wire", text).row(row).picture(
        "bead",
        picture,
        "From rest on the right, 24 equally spaced times: fast on the flat bottom, slow on the walls.",
    ))
}

fn wire(x: f64) -> f64 {
    x.powi(4) / 4.0
}
