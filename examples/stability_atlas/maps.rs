//! The flapping of a helicopter blade in forward flight, over Lock number and advance ratio.

use crate::{Outcome, Scene};
use std::f64::consts::TAU;
use tfe::RunError;
use tfe::charts::{Axis, Class, Colour, HeatMap, Section};
use tfe::prelude::*;
use tfe::stability::StabilityMap;

/// A rigid blade, hinged at the rotor axis, about its steady flapping; the azimuth angle is the time, γ the Lock
/// number, μ the advance ratio:
///
/// ```text
/// β̈ + γ/8 (1 + 4/3 μ sin t) β̇ + (1 + γ/8 (4/3 μ cos t + μ² sin 2t)) β = 0
/// ```
#[dynamics(
    coordinates(beta),
    let aero = lock/8,
    lagrangian = dot(beta)^2/2,
    force(beta) = -aero*(1 + 4/3*mu*sin(t))*dot(beta) - (1 + aero*(4/3*mu*cos(t) + mu^2*sin(2*t)))*beta,
)]
struct Blade {
    lock: f64,
    mu: f64,
}

const SIDE: usize = if cfg!(debug_assertions) { 40 } else { 200 };

pub fn scene() -> Outcome {
    let plan = StabilityMap::over(0.0..24.0, 0.0..2.5).resolution(SIDE, SIDE);
    let rates = plan.floquet(|lock, mu| Blade { lock, mu }, TAU, Mixed::<5>, 24)?;
    let kinds = plan.run(|lock, mu| kind(&Blade { lock, mu }))?;
    let failures = [
        rates.first_failure().map(ToString::to_string),
        kinds.first_failure().map(ToString::to_string),
    ];
    if let Some(failure) = failures.into_iter().flatten().next() {
        return Err(failure.into());
    }
    let unstable = 100.0 * rates.fraction_unstable().unwrap_or(f64::NAN);
    let onset =
        (0..SIDE).find(|&row| (0..SIDE).any(|column| is_unstable(rates.value(column, row))));
    let onset = onset.map_or(f64::NAN, |row| rates.y(row));
    let rate = |i, j| rates.value(i, j).map(|radius| radius.ln() / TAU);
    let axes = |picture: HeatMap| {
        let picture = picture.x(Axis::new("Lock number γ").range(0.0..24.0));
        picture.y(Axis::new("advance ratio μ").range(0.0..2.5))
    };
    let size = (SIDE, SIDE);
    let class = |i, j| kinds.value(i, j).map(|kind| kind as usize);
    let section = Section::new("A flapping blade in forward flight")
        .paragraph(
            "A helicopter blade is damped by the air; in forward flight the damping is periodic. Its two \
             Floquet multipliers are a pair with |λ| = e^(−πγ/8), or real: the blade then flaps \
             in a whole or half multiple of the rotor speed, one motion damped less, the other \
             more. The model neglects reverse flow: beyond an advance ratio of about one \
             half, the map describes this equation rather than a helicopter.",
        )
        .figure(
            axes(
                HeatMap::classes(
                    "Flapping blade: frequency and stability",
                    size,
                    classes(),
                    class,
                )
                .size(760, 540),
            )
            .to_svg()?,
            format!(
                "Where the frequency locks to the rotor's, and where flapping grows: nowhere \
                 below μ = {onset:.2}, on {unstable:.0} % of the map."
            ),
        )
        .figure(
            axes(
                HeatMap::new(
                    "Flapping blade: growth rate of the less damped motion",
                    size,
                    rate,
                )
                .size(760, 480)
                .values("σ = ln |λ| / 2π"),
            )
            .to_svg()?,
            "In hover (μ = 0) σ = −γ/16 until the blade is overdamped at γ = 16. The dark lines \
             are the borders of locking, where both motions are equally damped.",
        );
    let key = format!(
        "{SIDE} × {SIDE} blades, twice; {unstable:.1} % unstable, none below μ = {onset:.2}"
    );
    Ok(Scene { section, key })
}

fn is_unstable(radius: Option<f64>) -> bool {
    radius.is_some_and(|radius| radius > 1.0)
}

/// The class of a blade, from the trace and the determinant of its transition matrix over one revolution.
fn kind(blade: &Blade) -> Result<f64, RunError<1>> {
    let revolution = Simulation::new(blade).element(Mixed::<5>).step(TAU / 24.0);
    let matrix = revolution
        .run_linearised(blade.state([0.0], [0.0]), 0.0..TAU)?
        .product();
    let (trace, determinant) = (matrix.trace(), matrix.determinant());
    if trace * trace < 4.0 * determinant {
        return Ok(0.0);
    }
    let largest = (trace.abs() + (trace * trace - 4.0 * determinant).sqrt()) / 2.0;
    Ok(match (trace > 0.0, largest > 1.0) {
        (true, false) => 1.0,
        (false, false) => 2.0,
        (true, true) => 3.0,
        (false, true) => 4.0,
    })
}

fn classes() -> Vec<Class> {
    vec![
        Class::new("damped, free frequency", Colour::WHITE),
        Class::new(
            "damped, locked to 0, 1, … per revolution",
            Colour(190, 215, 235),
        ),
        Class::new(
            "damped, locked to ½, … per revolution",
            Colour(200, 230, 200),
        ),
        Class::new("grows, 0, 1, … per revolution", Colour(0, 114, 178)),
        Class::new("grows, ½, … per revolution", Colour(0, 130, 90)),
    ]
}
