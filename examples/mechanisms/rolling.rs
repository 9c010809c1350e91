//! Wheels that roll without slip (nonholonomic constraints).

use crate::Outcome;
use crate::runs::{Energy, Run, Scene};
use crate::stroboscope::{Part, Point, Stroboscope, seen};
use std::error::Error;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, TAU};
use tfe::prelude::*;

/// A coin that rolls upright on an incline, x downhill; its heading φ is measured from there, ψ is its rolling angle;
/// SI units.
#[dynamics(
    coordinates(x, y, phi, psi),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + m*r^2/8*dot(phi)^2 + m*r^2/4*dot(psi)^2 + m*g*sin(alpha)*x,
    constraint(roll_x) = dot(x) - r*cos(phi)*dot(psi),
    constraint(roll_y) = dot(y) - r*sin(phi)*dot(psi),
)]
struct Coin {
    m: f64,
    r: f64,
    g: f64,
    alpha: f64,
}

/// The model that results from varying L + μ·Ψ without the correction force of the nonholonomic constraints Ψ = 0 (the
/// vakonomic equations). The multipliers μ are the rates of two additional coordinates, whose equations, dΨ/dt = 0,
/// keep an initial state without slip free of slip.
#[dynamics(
    coordinates(x, y, phi, psi, nu_x, nu_y),
    lagrangian = m/2*(dot(x)^2 + dot(y)^2) + m*r^2/8*dot(phi)^2 + m*r^2/4*dot(psi)^2 + m*g*sin(alpha)*x
        + dot(nu_x)*(dot(x) - r*cos(phi)*dot(psi)) + dot(nu_y)*(dot(y) - r*sin(phi)*dot(psi)),
)]
struct VakonomicCoin {
    m: f64,
    r: f64,
    g: f64,
    alpha: f64,
}

pub fn coin() -> Outcome {
    let (m, r, g, alpha) = (1.0, 0.1, 9.81, FRAC_PI_6);
    let model = Coin { m, r, g, alpha };
    let (w, end) = (2.0, 4.0);
    let run = Run::of(
        &model,
        Mixed::<6>,
        0.05,
        model.state([0.0; 4], [0.0, 0.0, w, 0.0]),
        end,
    )?;
    // The effective mass of a thin disk is m + I/r² = 3m/2: x = b sin² wt, y = b (wt − ½ sin 2wt), ψ = 2b (1 − cos
    // wt)/r, b = g sin α/3w².
    let b = g * alpha.sin() / (3.0 * w * w);
    let angle = w * end;
    let exact = [
        b * angle.sin().powi(2),
        b * (angle - (2.0 * angle).sin() / 2.0),
        angle,
        2.0 * b * (1.0 - angle.cos()) / r,
    ];
    let row = run.row(
        "rolling coin",
        Energy::Conserved,
        run.error(&exact),
        "closed form",
    );

    let vakonomic = VakonomicCoin { m, r, g, alpha };
    let start = vakonomic.state([0.0; 6], [0.0, 0.0, w, 0.0, 0.0, 0.0]);
    // Large multipliers drive the heading, which oscillates fast: the steps are short.
    let other = Run::of(&vakonomic, Mixed::<6>, 0.002, start, end)?;
    let apart = other.error(&exact[..2]);
    assert!(
        apart > 0.01,
        "the vakonomic path should differ from that of the coin, but only by {apart:e} m"
    );

    let across = |x: f64, y: f64| (y, -x);
    // Upright, seen from above.
    let disk = |q: &[f64; 4]| {
        vec![Part::block(
            across(q[0], q[1]),
            q[2] - FRAC_PI_2,
            2.0 * r,
            0.3 * r,
        )]
    };
    let picture = Stroboscope::new("Rolling coin on an incline", "across (m)", "uphill (m)")
        .path("coin", run.samples(400)?.iter().map(|q| across(q[0], q[1])))
        .dashed(
            "without the correction force",
            other.samples(400)?.iter().map(|q| across(q[0], q[1])),
        )
        .shots(run.samples(41)?.iter().map(disk))
        .to_svg()?;
    let text = "The two constraints on velocities cannot be replaced by constraints on positions. Varying L + μ·Ψ alone gives other \
                equations, called \"vakonomic\", whose motion depends on initial values of the multipliers (here zero) and is not that of a coin.";
    Ok(Scene::new("A rolling coin", text).row(row).picture(
        "coin",
        picture,
        format!(
            "Seen from above the incline, 4 s. At the end the vakonomic path is {apart:.2} m away."
        ),
    ))
}

/// A thin uniform disk on a level plane: contact point (x, y), heading, lean to the left from the vertical, and spin
/// angle; SI units.
#[dynamics(
    coordinates(x, y, heading, lean, spin),
    let cx = x - r*sin(lean)*sin(heading),
    let cy = y + r*sin(lean)*cos(heading),
    let cz = r*cos(lean),
    lagrangian = m/2*(dot(cx)^2 + dot(cy)^2 + dot(cz)^2)
        + m*r^2/8*(dot(lean)^2 + (dot(heading)*cos(lean))^2) + m*r^2/4*(dot(spin) - dot(heading)*sin(lean))^2
        - m*g*cz,
    constraint(roll_x) = dot(x) - r*cos(heading)*dot(spin),
    constraint(roll_y) = dot(y) - r*sin(heading)*dot(spin),
)]
struct Disk {
    m: f64,
    r: f64,
    g: f64,
}

impl Disk {
    /// The state of rolling straight at this speed, with a small rate of leaning.
    fn start(&self, speed: f64, leaning: f64) -> State<5> {
        self.state([0.0; 5], [speed, 0.0, 0.0, leaning, speed / self.r])
    }

    /// The points of the rim in space.
    fn rim(&self, q: &[f64; 5]) -> Vec<[f64; 3]> {
        let [x, y, heading, lean, _] = *q;
        let (sin, cos) = heading.sin_cos();
        let up = [-lean.sin() * sin, lean.sin() * cos, lean.cos()];
        let forward = [cos, sin, 0.0];
        let contact = [x, y, 0.0];
        let on_rim = |angle: f64| {
            let (along, above) = (self.r * angle.sin(), self.r * (1.0 - angle.cos()));
            std::array::from_fn(|k| contact[k] + along * forward[k] + above * up[k])
        };
        (0..48).map(|k| on_rim(TAU * f64::from(k) / 48.0)).collect()
    }
}

pub fn disk() -> Outcome {
    let model = Disk {
        m: 1.0,
        r: 0.5,
        g: 9.81,
    };
    let limit = (model.g * model.r / 3.0).sqrt();
    // Just above the critical speed, below which a disk that rolls straight falls over.
    let start = model.start(1.1 * limit, 0.9);
    let run = Run::of(&model, Mixed::<6>, 0.01, start, 4.0)?;
    let finer = Run::of(&model, Mixed::<8>, 0.005, start, 4.0)?;
    let error = run.error(&finer.motion.last().q);
    let row = run.row("rolling disk", Energy::Conserved, error, "finer run");
    let found = critical_speed(&model)?;
    assert!(
        (found / limit - 1.0).abs() < 1e-4,
        "critical speed {found} m/s instead of {limit} m/s"
    );

    let rim = |q: &[f64; 5]| {
        vec![Part::Outline(
            model.rim(q).into_iter().map(seen).collect::<Vec<Point>>(),
        )]
    };
    let picture = Stroboscope::new("Rolling disk", "across (m)", "up (m)")
        .path(
            "contact point",
            run.samples(400)?.iter().map(|q| seen([q[0], q[1], 0.0])),
        )
        .shots(run.samples(21)?.iter().map(rim))
        .to_svg()?;
    let text = "A disk does not fall over while it rolls fast enough, since it steers into its fall. Rolling straight is stable above \
                v² = gr/3.";
    let caption = "Rolling at 1.1 times the critical speed, pushed to the side: it wobbles along its path. Seen from the right, the front and above.";
    let text_found = format!(
        "From the transition matrix on the constraints the critical speed is {found:.6} m/s; √(gr/3) = {limit:.6} m/s."
    );
    let scene = Scene::new("A rolling disk", text)
        .row(row)
        .paragraph(text_found);
    Ok(scene.picture("disk", picture, caption))
}

/// The speed at which rolling straight changes its stability, by bisection on the spectral radius of one step.
///
/// Rolling along circles of any radius is a neutral motion, so that the multiplier 1 has a Jordan block of size three
/// (lean, heading, position), and its computed modulus has an error of about the cube root of the rounding unit.
/// Therefore only a growth of more than 10⁻⁴ per step counts as unstable; since σ² ∝ v_c² − v², that changes the speed
/// by about 10⁻⁶.
fn critical_speed(model: &Disk) -> Result<f64, Box<dyn Error>> {
    let (mut falls, mut rolls) = (0.5, 3.0);
    for _ in 0..40 {
        let speed = (falls + rolls) / 2.0;
        let start = model.start(speed, 0.0);
        let matrix = stability::on_constraints(model, Mixed::<6>, &start, 0.0, 0.1)?;
        if stability::spectral_radius(&matrix) > 1.0 + 1e-4 {
            falls = speed;
        } else {
            rolls = speed;
        }
    }
    Ok((falls + rolls) / 2.0)
}
