//! Time against accuracy for periodic orbits and their Floquet multipliers.

use crate::{Outcome, Scene};
use nalgebra::Complex;
use std::error::Error;
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;
use tfe::charts::{Axis, Chart, Scale, Section, Style};
use tfe::periodic::OrbitError;
use tfe::prelude::*;

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2, force(x) = mu*(1 - x^2)*dot(x))]
pub struct VanDerPol {
    pub mu: f64,
}

#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - alpha/2*x^2 - beta/4*x^4,
           force(x) = f*cos(omega*t) - delta*dot(x))]
struct Duffing {
    alpha: f64,
    beta: f64,
    delta: f64,
    f: f64,
    omega: f64,
}

/// A rigid flapping blade in forward flight; the azimuth angle is the time.
#[dynamics(
    coordinates(b),
    let aero = lock/8,
    lagrangian = dot(b)^2/2,
    force(b) = -aero*(1 + 4/3*mu*sin(t))*dot(b) - (1 + aero*(4/3*mu*cos(t) + mu^2*sin(2*t)))*b
        + aero*(th0*(1 + 8/3*mu*sin(t) + 2*mu^2*sin(t)^2) - lam*(4/3 + 2*mu*sin(t))),
)]
struct Blade {
    lock: f64,
    mu: f64,
    th0: f64,
    lam: f64,
}

/// Reference multipliers, by shooting with 60 digits.
const VAN_DER_POL: [Complex<f64>; 2] = [
    Complex::new(1.0, 0.0),
    Complex::new(0.0008596950636038052, 0.0),
];
const DUFFING: [Complex<f64>; 2] = pair(0.06653933012849203, 0.6349172952115101);
const BLADE: [Complex<f64>; 2] = pair(0.024942438197423082, 0.03528905649738625);

const fn pair(re: f64, im: f64) -> [Complex<f64>; 2] {
    [Complex::new(re, im), Complex::new(re, -im)]
}

const ELEMENTS: [usize; 9] = [3, 5, 7, 10, 15, 20, 40, 80, 160];
// Without optimisation, times are not meaningful: one repetition is enough.
const REPETITIONS: usize = if cfg!(debug_assertions) { 1 } else { 15 };
const TARGET: f64 = 1e-12;

type Multipliers = Result<Vec<Complex<f64>>, OrbitError>;

pub fn scene() -> Outcome {
    let van_der_pol = VanDerPol { mu: 1.0 };
    let duffing = Duffing {
        alpha: 1.0,
        beta: 1.0,
        delta: 0.2,
        f: 0.3,
        omega: 1.4,
    };
    let blade = Blade {
        lock: 8.0,
        mu: 0.3,
        th0: 0.1,
        lam: 0.05,
    };
    let problems = [
        Problem::measure(
            "Van der Pol, μ = 1 (period unknown)",
            &VAN_DER_POL,
            |element, elements| limit_cycle(&van_der_pol, element, elements),
        )?,
        Problem::measure(
            "Forced Duffing oscillator",
            &DUFFING,
            |element, elements| {
                let orbit = PeriodicOrbit::of(&duffing)
                    .element(element)
                    .elements(elements)
                    .period(TAU / 1.4);
                let guess = |t: f64| ([-0.3 * (1.4 * t).cos()], [0.42 * (1.4 * t).sin()]);
                Ok(orbit.guess(guess).solve()?.multipliers().to_vec())
            },
        )?,
        Problem::measure("Flapping blade, μ = 0.3", &BLADE, |element, elements| {
            let orbit = PeriodicOrbit::of(&blade)
                .element(element)
                .elements(elements)
                .period(TAU);
            Ok(orbit.solve()?.multipliers().to_vec())
        })?,
    ];
    if let Some(problem) = problems.iter().find(|one| one.fastest().is_none()) {
        return Err(format!("{}: no setting reaches {TARGET:e}", problem.title).into());
    }
    let mut section = Section::new("Time against accuracy").paragraph(
        "A periodic orbit and its Floquet multipliers, from a rough guess (a circle, or rest) \
         to the solution: the time of all computations, on one processor, as the median of several \
         solutions. The error is that of the multipliers, relative to the largest of them, \
         against references of 20 digits.",
    );
    for problem in &problems {
        section = section.figure(problem.picture()?, problem.caption());
    }
    let section = section.table(
        ["problem", "fastest with error ≤ 10⁻¹²", "time", "error"],
        problems.iter().map(Problem::row),
    );
    let key = problems.iter().map(|problem| {
        problem.fastest().map_or("—".to_owned(), |(_, point)| {
            format!("{:.3} ms", 1e3 * point.time)
        })
    });
    let key = format!(
        "multipliers to 10⁻¹² in {}",
        key.collect::<Vec<_>>().join(", ")
    );
    Ok(Scene { section, key })
}

fn limit_cycle(model: &VanDerPol, element: Element, elements: usize) -> Multipliers {
    let orbit = PeriodicOrbit::of(model)
        .element(element)
        .elements(elements)
        .unknown_period(6.3);
    let orbit = orbit
        .guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]))
        .solve()?;
    Ok(orbit.multipliers().to_vec())
}

/// One combination of element and mesh for one problem.
#[derive(Clone, Copy)]
struct Point {
    elements: usize,
    /// Seconds.
    time: f64,
    error: f64,
}

struct Problem {
    title: &'static str,
    curves: Vec<(Element, Vec<Point>)>,
    failed: usize,
}

impl Problem {
    fn measure(
        title: &'static str,
        reference: &[Complex<f64>; 2],
        solve: impl Fn(Element, usize) -> Multipliers,
    ) -> Result<Self, Box<dyn Error>> {
        let mut problem = Self {
            title,
            curves: Vec::new(),
            failed: 0,
        };
        for nodes in [4, 6, 8, 10] {
            let element = Element::mixed(nodes);
            let mut points = Vec::new();
            for elements in ELEMENTS {
                // No solution because the mesh is too coarse for the guess: the point is left out, and counted.
                let Ok(multipliers) = solve(element, elements) else {
                    problem.failed += 1;
                    continue;
                };
                let time = median_time(|| solve(element, elements))?;
                points.push(Point {
                    elements,
                    time,
                    error: error(&multipliers, reference),
                });
            }
            problem.curves.push((element, points));
        }
        Ok(problem)
    }

    /// The fastest combination that reaches the target.
    fn fastest(&self) -> Option<(Element, Point)> {
        let all = self
            .curves
            .iter()
            .flat_map(|(element, points)| points.iter().map(move |point| (*element, *point)));
        all.filter(|(_, point)| point.error <= TARGET)
            .min_by(|a, b| a.1.time.total_cmp(&b.1.time))
    }

    fn row(&self) -> [String; 4] {
        let title = self.title.to_owned();
        match self.fastest() {
            None => [title, "none".to_owned(), String::new(), String::new()],
            Some((element, point)) => [
                title,
                format!("{} elements {element}", point.elements),
                format!("{:.3} ms", 1e3 * point.time),
                format!("{:.1e}", point.error),
            ],
        }
    }

    fn caption(&self) -> String {
        let fastest = self.fastest().map_or_else(
            || "No setting reaches 10⁻¹².".to_owned(),
            |(element, point)| {
                format!(
                    "10⁻¹² after {:.3} ms: {} elements {element}.",
                    1e3 * point.time,
                    point.elements
                )
            },
        );
        let failed = match self.failed {
            0 => String::new(),
            count => format!(" {count} of the coarsest meshes have no solution near the guess."),
        };
        format!(
            "{fastest} Meshes of {} to {} elements.{failed} * Figures for compiled shooting \
             codes and for a well-known collocation code on comparable machines, not measured \
             here.",
            ELEMENTS[0],
            ELEMENTS[ELEMENTS.len() - 1]
        )
    }

    fn picture(&self) -> Result<String, Box<dyn Error>> {
        let (low, high) = (1e-16, 1.0);
        let upright = |time: f64| [(time, low), (time, high)];
        let mut chart = Chart::new(self.title)
            .x(Axis::new("time of a solution with its multipliers (ms)")
                .scale(Scale::Logarithmic)
                .range(0.02..5.0))
            .y(Axis::new("error of the multipliers")
                .scale(Scale::Logarithmic)
                .range(low..high));
        for (element, points) in &self.curves {
            // An error of zero is less than the last digit of the reference.
            let points = points
                .iter()
                .map(|point| (1e3 * point.time, point.error.max(low)));
            chart = chart.series(element.to_string(), Style::LineWithMarkers, points);
        }
        let chart = chart
            .series("0.05…0.15 ms: shooting*", Style::Reference, upright(0.05))
            .series("", Style::Reference, upright(0.15))
            .series("1.4 ms: collocation*", Style::Reference, upright(1.4));
        Ok(chart.to_svg()?)
    }
}

/// max |μ − μ_ref| / max |μ_ref|, NaN if one is; in both lists the multiplier of largest modulus, or of positive
/// imaginary part, comes first.
fn error(multipliers: &[Complex<f64>], reference: &[Complex<f64>; 2]) -> f64 {
    assert_eq!(multipliers.len(), reference.len());
    let differences = multipliers
        .iter()
        .zip(reference)
        .map(|(a, b)| (a - b).norm().abs());
    differences.max_by(f64::total_cmp).unwrap_or(f64::NAN) / reference[0].norm()
}

/// The median of the times of several solutions, in seconds.
pub fn median_time<T>(solve: impl Fn() -> Result<T, OrbitError>) -> Result<f64, OrbitError> {
    let mut times = Vec::with_capacity(REPETITIONS);
    for _ in 0..REPETITIONS {
        let clock = Instant::now();
        black_box(solve()?);
        times.push(clock.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    Ok(times[REPETITIONS / 2])
}
