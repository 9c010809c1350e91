//! The elastic pendulum, a mass that swings on a stiff spring: the energy error near resonances of the step size with
//! the spring, and the 2 : 1 resonance of the model itself.

use crate::{Outcome, Scene, grid};
use rayon::prelude::*;
use std::error::Error;
use std::f64::consts::TAU;
use tfe::charts::{Axis, Chart, HeatMap, Scale, Section};
use tfe::prelude::*;
use tfe::stability::{FloquetError, StabilityMap};

/// A unit mass on a spring of unit length and stiffness k; θ is measured from the downward vertical.
#[dynamics(
    coordinates(r, theta),
    lagrangian = (dot(r)^2 + r^2*dot(theta)^2)/2 + g*r*cos(theta) - k/2*(r - 1)^2,
)]
struct ElasticPendulum {
    g: f64,
    k: f64,
}

/// The linear equation of small swings during the vertical oscillation r = r_s (1 + a cos τ), r_s = 1 + g/k, τ = √k t:
///
/// ```text
/// (r² θ')' + r θ / ν² = 0 ,     ν = √k / √(g/r_s) ,  r in units of r_s
/// ```
#[dynamics(
    coordinates(theta),
    let r = 1 + a*cos(t),
    lagrangian = r^2*dot(theta)^2/2 - r*theta^2/(2*nu^2),
)]
struct Swing {
    nu: f64,
    a: f64,
}

const STIFF: ElasticPendulum = ElasticPendulum { g: 1.0, k: 2500.0 };
const END: f64 = 100.0;

pub fn scene() -> Outcome {
    let elements: [Element; 4] = [
        Primal::<2>.into(),
        Primal::<3>.into(),
        Mixed::<2>.into(),
        Mixed::<3>.into(),
    ];
    let sweeps = elements.map(|element| (element, sweep(element)));
    let mixed = sweeps[2..].iter().flat_map(|(_, points)| points);
    let bound = mixed.clone().map(|point| point.1).fold(0.0, f64::max);
    if mixed.into_iter().any(|point| !point.1.is_finite()) {
        return Err("a run with a mixed element did not end".into());
    }
    let (map, picture) = resonance()?;
    let orbit = bouncing()?;
    let difference = (orbit.multiplier - orbit.by_map).abs();
    // Order 14 with 40 elements: the error that remains is that of the iterations.
    assert!(
        difference < 1e-9 && orbit.period_error.abs() < 1e-9,
        "{difference:e} {:e}",
        orbit.period_error
    );
    let rows = sweeps.iter().map(|(element, points)| {
        let failed = points.iter().filter(|point| !point.1.is_finite()).count();
        [
            element.to_string(),
            lost_or(worst(points)),
            failed.to_string(),
        ]
    });
    let section = Section::new("The elastic pendulum")
        .paragraph(
            "A mass on a spring that swings: r is stiff (√k = 50), θ is slow (√g = 1). It \
             starts at rest from 60°, with a slightly stretched spring. An element whose steps do \
             not resolve the spring should not excite it.",
        )
        .figure(
            errors(&sweeps)?,
            format!(
                "The worst energy error of runs over 100 units of time. Primal elements are \
                 unstable if h√k lies in their unstable intervals: from √12 on with two \
                 nodes, from √10 to √12 with three. Mixed elements stay below {bound:.1e} \
                 everywhere; their small peaks are steps in which the spring turns by a simple fraction \
                 of a revolution."
            ),
        )
        .table(
            [
                "element",
                "worst energy error",
                "runs that ended with an error",
            ],
            rows,
        )
        .figure(
            picture,
            format!(
                "An instability of the model, not of the method: a pendulum that bounces up and down with \
                 amplitude a begins to swing where its frequency is half of that of the spring, ν \
                 = 2, over a wider range the higher it bounces. Colour: growth of the swing over \
                 one bounce, zero where bouncing is stable (dark). {:.0} % of the map are \
                 unstable.",
                100.0 * map.fraction_unstable().unwrap_or(f64::NAN)
            ),
        )
        .paragraph(format!(
            "One point of the map, computed with the full model: PeriodicOrbit finds the bouncing \
             orbit of ν = 2, a = 0.3 by its energy (period {:.12}, √k T/2π − 1 = {:.0e}); its \
             largest multiplier is {:.12}, the map has {:.12}.",
            orbit.period, orbit.period_error, orbit.multiplier, orbit.by_map
        ));
    let key = format!(
        "worst energy error: {} {}, {} {}; bouncing orbit: multiplier {:.6}, error \
         {difference:.0e}",
        sweeps[1].0,
        lost_or(worst(&sweeps[1].1)),
        sweeps[3].0,
        lost_or(worst(&sweeps[3].1)),
        orbit.multiplier
    );
    Ok(Scene { section, key })
}

/// (h√k, worst relative energy error) for runs with one element.
fn sweep(element: Element) -> Vec<(f64, f64)> {
    let count = if cfg!(debug_assertions) { 50 } else { 295 };
    let steps: Vec<f64> = grid(0.1, 5.0, count).collect();
    let start = STIFF.state([1.01, TAU / 6.0], [0.0, 0.0]);
    let run = |&step: &f64| {
        let simulation = Simulation::new(&STIFF)
            .element(element)
            .step(step / STIFF.k.sqrt());
        let run = simulation.record_every(2).run(start, 0.0..END);
        (step, run.map_or(f64::NAN, |motion| motion.energy_error()))
    };
    steps.par_iter().map(run).collect()
}

fn worst(points: &[(f64, f64)]) -> f64 {
    points.iter().map(|point| point.1).fold(0.0, f64::max)
}

/// An energy error as text, or “over 100” if the run is useless.
fn lost_or(error: f64) -> String {
    if error < 100.0 {
        format!("{error:.1e}")
    } else {
        "over 100".to_owned()
    }
}

fn errors(sweeps: &[(Element, Vec<(f64, f64)>)]) -> Result<String, Box<dyn Error>> {
    let mut chart = Chart::new("Elastic pendulum: energy error")
        .x(Axis::new("h √k").range(0.0..5.0))
        .y(Axis::new("worst relative energy error")
            .scale(Scale::Logarithmic)
            .range(1e-8..1e4));
    for (element, points) in sweeps {
        chart = chart.line(element.to_string(), points.clone());
    }
    Ok(chart.to_svg()?)
}

/// The growth of a small swing during one period of the bounce.
fn resonance() -> Result<(StabilityMap<FloquetError>, String), Box<dyn Error>> {
    let (columns, rows) = if cfg!(debug_assertions) {
        (80, 48)
    } else {
        (400, 240)
    };
    let map = StabilityMap::over(1.0..4.0, 0.0..0.8)
        .resolution(columns, rows)
        .floquet(|nu, a| Swing { nu, a }, TAU, Mixed::<5>, 12)?;
    if let Some(failure) = map.first_failure() {
        return Err(failure.to_string().into());
    }
    let growth = |i, j| map.value(i, j).map(|radius| radius.max(1.0).ln());
    let picture = HeatMap::new(
        "Bouncing spring: growth of the swing in one bounce",
        (map.columns(), map.rows()),
        growth,
    )
    .x(Axis::new("ν = frequency of the spring / frequency of the pendulum").range(1.0..4.0))
    .y(Axis::new("amplitude a of the bounce / rest length r_s").range(0.0..0.8))
    .values("ln |largest multiplier|")
    .to_svg()?;
    Ok((map, picture))
}

struct Bouncing {
    period: f64,
    /// √k T/2π − 1
    period_error: f64,
    multiplier: f64,
    by_map: f64,
}

/// The bouncing orbit of the full model at ν = 2, a = 0.3, found by its energy, and its non-trivial multiplier.
fn bouncing() -> Result<Bouncing, Box<dyn Error>> {
    // ν² = k r_s/g = (k + g)/g
    let pendulum = ElasticPendulum { g: 1.0, k: 3.0 };
    let (root, rest, a) = (3.0_f64.sqrt(), 4.0 / 3.0, 0.3_f64);
    let top = rest * (1.0 + a);
    let energy = 1.5 * (top - 1.0).powi(2) - top;
    let orbit = PeriodicOrbit::of(&pendulum)
        .element(Mixed::<8>)
        .unknown_period(3.6)
        .energy(energy)
        .guess(|t| {
            let (sin, cos) = (root * t).sin_cos();
            ([rest * (1.0 + a * cos), 0.0], [-rest * a * root * sin, 0.0])
        })
        .solve()?;
    let multiplier = orbit
        .multipliers()
        .iter()
        .map(|value| value.norm())
        .fold(0.0, f64::max);
    let half = 1e-3;
    let point = StabilityMap::over(2.0 - half..2.0 + half, a - half..a + half)
        .resolution(1, 1)
        .floquet(|nu, a| Swing { nu, a }, TAU, Mixed::<8>, 40)?;
    Ok(Bouncing {
        period: orbit.period(),
        period_error: root * orbit.period() / TAU - 1.0,
        multiplier,
        by_map: point.value(0, 0).ok_or("no multiplier")?,
    })
}
