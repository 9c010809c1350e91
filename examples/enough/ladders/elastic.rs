//! A pendulum on a spring: from which stiffness on it is a rod.

use super::{elements, fastest, ladder, micros, model_error, print_table, served, shown};
use std::error::Error;
use std::f64::consts::TAU;
use tfe::charts::{Axis, Chart, Scale, Section, Style};
use tfe::fidelity::Ladder;
use tfe::prelude::*;

/// A mass on a spring, from above; on a rod of its length, and on one as long as the spring is with the mass hanging at rest.
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

/// A ladder for each stiffness, and the errors of rods over all.
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
            "Seen: the rod errs by {rod}, the lengthened one by {long}; the cheapest is {}.",
            served(ladder)
        );
        sections.push(shown(ladder, &seen)?);
    }
    sections.push(summary(&ladders)?);
    Ok(sections)
}

/// Let go at 0.5 with the spring as long as it then is at rest, so that its fast oscillation is small, of the order of 1/k².
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

/// Steps begin with a period of the spring where there are at most a hundred, so that the reference does not stop at steps that miss its oscillation. Of stiffer
/// springs it does, where the oscillation is the only difference left between two runs: smaller errors are then not known.
fn parts(periods: f64) -> usize {
    if periods <= 100.0 {
        (periods.ceil() as usize).max(16)
    } else {
        16
    }
}

/// A line for each stiffness: errors of rods, and times beside those of the spring.
fn summary(ladders: &[(f64, Ladder)]) -> Result<Section, Box<dyn Error>> {
    let title = "From which stiffness on a spring is a rod";
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
    // From the second on phases are off by little.
    let exponents = [&rod, &long].map(|errors| exponent(errors.get(1..)?));
    assert!(ladders.len() < 3 || exponents[0].is_some(), "{rod:?}");
    for exponent in exponents.into_iter().flatten() {
        assert!((exponent + 1.0).abs() < 0.05, "{exponent}");
    }
    let scaled = |errors: &[(f64, f64)]| errors.last().map_or(f64::NAN, |(k, error)| k * error);
    let (by_rod, by_long) = (scaled(&rod), scaled(&long));
    let seen = format!(
        "Seen: errors of rods go with 1/k, so for each accuracy ε there is a stiffness from which on the rod serves, {by_rod:.0}/ε, and {by_long:.0}/ε for the rod lengthened by \
         the weight, which leaves what the tension changes during the swing. The spring's own oscillation, of amplitude 3 (m g sin θ/k)²/l at this start (7e-11 for k = 10⁶), \
         is missed by long steps: what is as small is not known there, and for k = 10⁸ it is below all accuracies asked for."
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

/// d log error / d log k between the ends.
fn exponent(errors: &[(f64, f64)]) -> Option<f64> {
    let ((k0, e0), (k1, e1)) = (errors.first()?, errors.last()?);
    (k0 < k1).then(|| (e1 / e0).ln() / (k1 / k0).ln())
}

const HEADINGS: [&str; 7] = [
    "k",
    "error of the rod",
    "times k",
    "of the longer rod",
    "times k",
    "µs of the longer rod",
    "µs of the spring for the same",
];

fn row(k: f64, ladder: &Ladder) -> [String; 7] {
    let rungs = ladder.rungs();
    let [rod, long] = [0, 1].map(|rung: usize| rungs[rung].model_error());
    let scaled = |error: Option<f64>| {
        error.map_or_else(|| "—".to_owned(), |error| format!("{:.1}", k * error))
    };
    // Twice the error of the model is what steps may double it to.
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
