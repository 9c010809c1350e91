//! Blades: bodies that can slide along one body-fixed direction, but not across it (nonholonomic constraints).

use crate::Outcome;
use crate::runs::{Energy, Run, Scene};
use crate::stroboscope::{Part, Stroboscope};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};
use tfe::charts::{Chart, Style};
use tfe::prelude::*;

/// A blade at the centre of mass of a plate on an incline, x downhill; SI units.
#[dynamics(
    coordinates(x, y, phi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(phi)^2 + m*g*sin(alpha)*x,
    constraint(blade) = dot(x)*sin(phi) - dot(y)*cos(phi),
)]
struct KnifeEdge {
    m: f64,
    j: f64,
    g: f64,
    alpha: f64,
}

pub fn knife_edge() -> Outcome {
    let model = KnifeEdge {
        m: 1.0,
        j: 1.0,
        g: 9.81,
        alpha: FRAC_PI_6,
    };
    let (w, end) = (1.3, 10.0);
    let run = Run::of(
        &model,
        Mixed::<6>,
        0.05,
        model.state([0.0; 3], [0.0, 0.0, w]),
        end,
    )?;
    // The closed form: x = b sin² wt, y = b (wt − ½ sin 2wt), b = g sin α/2w².
    let b = model.g * model.alpha.sin() / (2.0 * w * w);
    let angle = w * end;
    let exact = [
        b * angle.sin().powi(2),
        b * (angle - (2.0 * angle).sin() / 2.0),
        angle,
    ];
    let row = run.row(
        "knife edge",
        Energy::Conserved,
        run.error(&exact),
        "closed form",
    );
    // In the picture, downhill points down.
    let plate = |q: &[f64; 3]| vec![Part::block((q[1], -q[0]), q[2] - FRAC_PI_2, 0.7, 0.3)];
    let picture = Stroboscope::new("Knife edge on an incline", "across (m)", "uphill (m)")
        .path(
            "centre of mass",
            run.samples(500)?.iter().map(|q| (q[1], -q[0])),
        )
        .shots(run.samples(41)?.iter().map(plate))
        .to_svg()?;
    let text = "A plate on a blade slides on an incline and turns at a constant rate. It does not keep going down, but \
                moves along a cycloid across the incline.";
    let caption = "10 s; at the start the plate turns but does not move.";
    Ok(Scene::new("A knife edge", text)
        .row(row)
        .picture("knife_edge", picture, caption))
}

/// A sleigh on a blade at the distance a behind its centre of mass (x, y); SI units.
#[dynamics(
    coordinates(x, y, theta),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + j/2*dot(theta)^2,
    constraint(blade) = -dot(x)*sin(theta) + dot(y)*cos(theta) - a*dot(theta),
)]
struct Sleigh {
    m: f64,
    j: f64,
    a: f64,
}

/// The closed form of its motion: v = c tanh τ along the blade, ω = (c/k) sech τ, θ = (2k/a) arctan tanh(τ/2), τ =
/// (ac/k²)(t − t_0).
struct SleighMotion {
    k: f64,
    a: f64,
    c: f64,
    /// The time t₀, when it turns fastest.
    t_0: f64,
}

impl SleighMotion {
    /// v, ω, θ at a time.
    fn at(&self, t: f64) -> [f64; 3] {
        let Self { k, a, c, t_0 } = *self;
        let tau = a * c / (k * k) * (t - t_0);
        [
            c * tau.tanh(),
            c / k / tau.cosh(),
            2.0 * k / a * (tau / 2.0).tanh().atan(),
        ]
    }
}

pub fn sleigh() -> Outcome {
    let model = Sleigh {
        m: 1.0,
        j: 0.25,
        a: 0.3,
    };
    let k = (model.j / model.m + model.a * model.a).sqrt();
    let exact = SleighMotion {
        k,
        a: model.a,
        c: 1.0,
        t_0: 3.5,
    };
    let end = 8.0;
    // The velocity of the centre of mass: v along the blade and aω across it.
    let [v, omega, theta] = exact.at(0.0);
    let (sin, cos) = theta.sin_cos();
    let across = model.a * omega;
    let start = model.state(
        [0.0, 0.0, theta],
        [v * cos - across * sin, v * sin + across * cos, omega],
    );
    let run = Run::of(&model, Mixed::<6>, 0.1, start, end)?;
    let (last, last_v) = (run.motion.last(), run.motion.velocities().last());
    let [_, omega, theta] = exact.at(end);
    let turning = last_v.map_or(f64::NAN, |v| (v[2] - omega).abs());
    let error = turning + (last.q[2] - theta).abs();
    let against = "closed form of θ, ω";
    let row = run.row("Chaplygin sleigh", Energy::Conserved, error, against);

    let nodes = run.motion.states().iter().zip(run.motion.velocities());
    let along = nodes.map(|(node, v)| (node.t, v[0] * node.q[2].cos() + v[1] * node.q[2].sin()));
    let turning = run
        .motion
        .states()
        .iter()
        .zip(run.motion.velocities())
        .map(|(node, v)| (node.t, v[2]));
    let curve = |which: usize| {
        (0..=200)
            .map(|k| end * f64::from(k) / 200.0)
            .map(|t| (t, exact.at(t)[which]))
            .collect::<Vec<_>>()
    };
    let chart = Chart::new("Velocities of the sleigh")
        .x("t (s)")
        .y("v (m/s), ω (rad/s)")
        .series("c tanh τ", Style::Reference, curve(0))
        .series("(c/k) sech τ", Style::Reference, curve(1))
        .series("v along the blade", Style::Markers, along)
        .series("ω", Style::Markers, turning);

    let blade = |q: &[f64; 3]| (q[0] - model.a * q[2].cos(), q[1] - model.a * q[2].sin());
    let shot = |q: &[f64; 3]| {
        let (sin, cos) = q[2].sin_cos();
        let corner = |along: f64, aside: f64| {
            (
                q[0] + along * cos - aside * sin,
                q[1] + along * sin + aside * cos,
            )
        };
        let body = [
            (-0.3, -0.16),
            (0.3, -0.16),
            (0.45, 0.0),
            (0.3, 0.16),
            (-0.3, 0.16),
        ];
        vec![Part::Outline(
            body.map(|(along, aside)| corner(along, aside)).to_vec(),
        )]
    };
    let picture = Stroboscope::new("Chaplygin sleigh", "x (m)", "y (m)")
        .path("blade", run.samples(500)?.iter().map(blade))
        .path(
            "centre of mass",
            run.samples(500)?.iter().map(|q| (q[0], q[1])),
        )
        .shots(run.samples(17)?.iter().map(shot))
        .to_svg()?;
    let text = "Energy is conserved, and yet all motions approach the same one: the sleigh turns until its centre of mass is ahead of \
                the blade, and then goes straight. This is impossible in a Hamiltonian system.";
    Ok(Scene::new("The Chaplygin sleigh", text)
        .row(row)
        .picture(
            "sleigh",
            picture,
            "It starts blade first; at the cusp of its path the blade stands still.",
        )
        .picture(
            "sleigh_velocities",
            chart.to_svg()?,
            "Markers: nodes. Dashed: the closed form.",
        ))
}
