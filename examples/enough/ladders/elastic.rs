//! A pendulum on a spring: from which stiffness on the spring can be replaced by a rod.

use super::{elements, fastest, ladder, micros, model_error, print_table, served, shown};
use std::error::Error;
use std::f64::consts::TAU;
use tfe::charts::{Axis, Chart, Scale, Section, Style};
use tfe::fidelity::Ladder;
use tfe::prelude::*;

/// A mass on a spring; on a rod as long as the unstretched spring; and on a rod as long as the spring is with the mass
/// hanging at rest.
#[dynamics(
    coordinates(r, theta),
    lagrangian = m/2*(dot(r)^2 + r^2*dot(theta)^2) + m*g*r*cos(theta) - k/2*(r - l)^2,
    output(x) = r*sin(theta), output(y) = -r*cos(theta),
    model(Rod, frozen(r = l)),
    model(LongRod, frozen(r = l + m*g/k)),
)]
struct Spring {
    m: f64,
    l: f64,
    g: f64,
    k: f64,
}

/// A ladder for each stiffness, and the errors of the rods over all of them.
pub fn sections() -> Result<Vec<Section>, Box<dyn Error>> {
    let all = [(1e2, "10²"), (1e4, "10⁴"), (1e6, "10⁶"), (1e8, "10⁸")];
    let few = if cfg!(debug_assertions) { 2 } else { all.len() };
    let mut ladders = Vec::new();
    for (k, name) in &all[..few] {
        ladders.push((*k, swing(*k, name)?));
    }
    let mut sections = Vec::new();
    for (_, ladder) in &ladders {
        let [rod, long] = [0, 1].map(|rung: usize| model_error(&ladder.rungs()[rung]));
        let seen = format!(
            "Result: the rod has an error of {rod}, the lengthened one of {long}; the cheapest model is {}.",
            served(ladder)
        );
        sections.push(shown(ladder, &seen)?);
    }
    sections.push(summary(&ladders)?);
    Ok(sections)
}

/// Released at an angle of 0.5 with the length that the spring has there in equilibrium, so that its fast oscillation
/// is small, of the order of 1/k².
fn swing(k: f64, name: &str) -> Result<Ladder, Box<dyn Error>> {
    const ANGLE: f64 = 0.5;
    const END: f64 = 6.0;
    let spring = Spring {
        m: 1.0,
        l: 1.0,
        g: 9.81,
        k,
    };
    let Spring { m, l, g, .. } = spring;
    let (rod, long) = (Rod::of(&spring), LongRod::of(&spring));
    let length = l + m * g * ANGLE.cos() / k;
    let title = format!("A pendulum on a spring, k = {name}, over {END} s");
    Ok(ladder(title, END)
        .elements(elements())
        .rung("rod", &rod, rod.state([ANGLE], [0.0]))
        .rung("longer rod", &long, long.state([ANGLE], [0.0]))
        .rung("spring", &spring, spring.state([length, ANGLE], [0.0; 2]))
        .parts(parts(END * (k / m).sqrt() / TAU))
        .run()?)
}

/// The first step size tried resolves the oscillation of the spring, if the span has at most a hundred of its periods;
/// otherwise the reference might stop at steps that miss it. For stiffer springs it does: the oscillation is then the
/// only difference between two runs, and errors smaller than it are not known.
fn parts(periods: f64) -> usize {
    if periods <= 100.0 {
        (periods.ceil() as usize).max(16)
    } else {
        16
    }
}

/// A row for each stiffness: the errors of the rods, and their times compared with those of the spring.
fn summary(ladders: &[(f64, Ladder)]) -> Result<Section, Box<dyn Error>> {
    let title = "From which stiffness on can a rod replace a spring?";
    let error = |rung: usize| {
        let points = ladders.iter().filter_map(move |(k, ladder)| {
            let error = ladder.rungs()[rung].model_error()?;
            Some((*k, error))
        });
        points.collect::<Vec<_>>()
    };
    let (rod, long) = (error(0), error(1));
    let mut chart = Chart::new(title)
        .x(Axis::new("stiffness k").scale(Scale::Logarithmic))
        .y(Axis::new("error of the model").scale(Scale::Logarithmic))
        .series("rod", Style::LineWithMarkers, rod.clone())
        .series("longer rod", Style::LineWithMarkers, long.clone());
    if let (Some(first), Some(last)) = (rod.first(), rod.last()) {
        let slope = |(k, _): &(f64, f64)| (*k, last.0 * last.1 / k);
        chart = chart.series("1/k", Style::Reference, [slope(first), slope(last)]);
    }
    // The first stiffness is left out: only from the second on are the phase errors small.
    let exponents = [&rod, &long].map(|errors| exponent(errors.get(1..)?));
    assert!(ladders.len() < 3 || exponents[0].is_some(), "{rod:?}");
    for exponent in exponents.into_iter().flatten() {
        assert!((exponent + 1.0).abs() < 0.05, "{exponent}");
    }
    let scaled = |errors: &[(f64, f64)]| errors.last().map_or(f64::NAN, |(k, error)| k * error);
    let (by_rod, by_long) = (scaled(&rod), scaled(&long));
    let seen = format!(
        "Result: the errors of the rods are proportional to 1/k. A rod is therefore accurate to ε from the stiffness {by_rod:.0}/ε on, and from {by_long:.0}/ε on if it is lengthened by \
         the weight, which leaves the change of the tension during the swing. The spring's own oscillation, of amplitude 3 (m g sin θ/k)²/l at this start (7e-11 for k = 10⁶), \
         is missed by long steps: errors smaller than it are not known there. For k = 10⁸ it is below all accuracies asked for."
    );
    let rows: Vec<_> = ladders.iter().map(|(k, ladder)| row(*k, ladder)).collect();
    println!("\n{title}");
    print_table(HEADINGS, &rows);
    println!("{seen}");
    Ok(Section::new(title)
        .paragraph(&*seen)
        .figure(chart.to_svg()?, title)
        .table(HEADINGS, rows))
}

/// The slope d log error / d log k between the first and the last point.
fn exponent(errors: &[(f64, f64)]) -> Option<f64> {
    let ((k0, e0), (k1, e1)) = (errors.first()?, errors.last()?);
    (k0 < k1).then(|| (e1 / e0).ln() / (k1 / k0).ln())
}

const HEADINGS: [&str; 7] = [
    "k",
    "error of the rod",
    "error × k",
    "error of the longer rod",
    "error × k",
    "µs for the longer rod",
    "µs for the spring, same error",
];

fn row(k: f64, ladder: &Ladder) -> [String; 7] {
    let rungs = ladder.rungs();
    let [rod, long] = [0, 1].map(|rung: usize| rungs[rung].model_error());
    let scaled = |error: Option<f64>| {
        error.map_or_else(|| "—".to_owned(), |error| format!("{:.1}", k * error))
    };
    // The time for a total error of twice the error of the model.
    let [by_rod, by_spring] = [1, 2].map(|rung: usize| {
        let enough = long.map(|error| 2.0 * error);
        micros(enough.and_then(|enough| fastest(&rungs[rung], enough)))
    });
    [
        format!("{k:.0e}"),
        model_error(&rungs[0]),
        scaled(rod),
        model_error(&rungs[1]),
        scaled(long),
        by_rod,
        by_spring,
    ]
}
