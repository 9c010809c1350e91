//! The forced Duffing oscillator: resonance curves with folds by continuation, the backbone curve through their peaks,
//! and a period doubling.

use crate::{Outcome, Scene, grid};
use nalgebra::Complex;
use std::error::Error;
use std::f64::consts::TAU;
use tfe::charts::{Axis, Chart, Section, Style};
use tfe::continuation::{Event, EventKind};
use tfe::prelude::*;
use tfe::{Branch, Continuation};

/// ẍ + δẋ + αx + βx³ = F cos ωt
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - alpha/2*x^2 - beta/4*x^4,
           force(x) = f*cos(omega*t) - delta*dot(x), sensitivity(omega, f))]
#[derive(Clone)]
struct Duffing {
    alpha: f64,
    beta: f64,
    delta: f64,
    f: f64,
    omega: f64,
}

/// The free oscillator: no force, no damping, α = β = 1.
#[dynamics(coordinates(x), lagrangian = dot(x)^2/2 - x^2/2 - x^4/4)]
struct Free {}

type Points = Vec<(f64, f64)>;

pub fn scene() -> Outcome {
    let mut curves = Vec::new();
    for force in [0.05, 0.1, 0.2, 0.35, 0.5] {
        curves.push((force, resonance(force)?));
    }
    let (backbone, backbone_error) = backbone()?;
    // Order ten with 40 elements: the error that remains is that of the iterations.
    assert!(backbone_error < 1e-10, "{backbone_error:e}");
    let wells = Wells::new()?;
    let rows = curves
        .iter()
        .flat_map(|(force, branch)| fold_rows(*force, branch));
    let points: usize = curves.iter().map(|(_, branch)| branch.points().len()).sum();
    let doubling = &wells.doubling.point;
    let passing = critical(&doubling.multipliers, -1.0);
    assert!(
        (passing + 1.0).norm() < 1e-5,
        "the multiplier {passing} should be −1 at the doubling"
    );
    let next = wells.double.events_of(EventKind::PeriodDoubling).next();
    let next = next.map_or_else(String::new, |next| {
        format!(", and doubles again at F = {:.9}", next.point.parameter)
    });
    let section = Section::new("The forced Duffing oscillator")
        .paragraph(
            "ẍ + δẋ + αx + βx³ = F cos ωt. Continuation follows a periodic response through \
             folds, where it turns back, and computes the multipliers of every orbit; events \
             are located by root finding along the branch.",
        )
        .figure(
            resonance_picture(&curves, backbone)?,
            format!(
                "α = β = 1, δ = 0.1. Between the folds a response is unstable (dashed): when ω changes, \
                 the oscillator jumps at a fold. The backbone curve of free oscillations runs \
                 through the peaks; its periods agree with elliptic integrals to \
                 {backbone_error:.1e}. {points} orbits."
            ),
        )
        .table(
            [
                "F",
                "fold at ω",
                "amplitude there",
                "|critical multiplier − 1|",
            ],
            rows,
        )
        .figure(
            wells.picture()?,
            format!(
                "α = −1, β = 1, δ = 0.3, ω = 1.2: oscillations in one of two wells. At F = \
                 {:.9} a multiplier passes −1 (here {:.9}): the response with the period of the \
                 force becomes unstable and one of twice the period is born{next}.",
                doubling.parameter, passing.re
            ),
        );
    let folds = curves
        .iter()
        .map(|(_, branch)| branch.events_of(EventKind::Fold).count());
    let key = format!(
        "{} folds on {points} orbits; doubling at F = {:.9}; backbone periods to \
         {backbone_error:.1e}",
        folds.sum::<usize>(),
        doubling.parameter
    );
    Ok(Scene { section, key })
}

/// The branch of responses over ω.
fn resonance(force: f64) -> Result<Branch<Duffing, 1>, Box<dyn Error>> {
    let duffing = Duffing {
        alpha: 1.0,
        beta: 1.0,
        delta: 0.1,
        f: force,
        omega: 0.7,
    };
    let branch = Continuation::of(&duffing)
        .parameter(|duffing| &mut duffing.omega)
        .range(0.7..2.8)
        .period(|duffing| TAU / duffing.omega)
        .element(Mixed::<5>)
        .elements(40)
        .guess(move |t| {
            let (sin, cos) = (0.7 * t).sin_cos();
            ([1.5 * force * cos], [-1.05 * force * sin])
        })
        .largest_step(0.05)
        .run()?;
    Ok(branch)
}

/// (frequency, amplitude) of free oscillations for a range of energies, and the largest relative error of their
/// periods.
fn backbone() -> Result<(Points, f64), Box<dyn Error>> {
    let (mut points, mut errors) = (Vec::new(), Vec::new());
    for amplitude in grid(0.05, 2.9, 58) {
        let a2 = amplitude * amplitude;
        let rough = (1.0 + 0.75 * a2).sqrt();
        let orbit = PeriodicOrbit::of(&Free {})
            .element(Mixed::<6>)
            .unknown_period(TAU / rough)
            .energy(a2 / 2.0 + a2 * a2 / 4.0)
            .guess(|t| {
                let (sin, cos) = (rough * t).sin_cos();
                ([amplitude * cos], [-amplitude * rough * sin])
            })
            .solve()?;
        errors.push((orbit.period() / free_period(amplitude) - 1.0).abs());
        points.push((TAU / orbit.period(), amplitude));
    }
    let worst = errors.into_iter().max_by(f64::total_cmp);
    Ok((points, worst.ok_or("no orbit")?))
}

/// T = 4K(k)/√(1 + A²), k² = A²/(2 + 2A²), by the arithmetic–geometric mean.
fn free_period(amplitude: f64) -> f64 {
    let a2 = amplitude * amplitude;
    let (mut a, mut b) = (1.0, (1.0 - a2 / (2.0 + 2.0 * a2)).sqrt());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    TAU / (a * (1.0 + a2).sqrt())
}

/// The stable or the unstable orbits of a branch as (parameter, amplitude), with gaps between separate parts. Events
/// belong to both.
fn part(branch: &Branch<Duffing, 1>, is_stable: bool) -> Points {
    let mut points = Vec::new();
    for (place, orbit) in branch.points().iter().enumerate() {
        let at = (orbit.parameter, orbit.amplitudes[0]);
        points.push(if orbit.is_stable() == is_stable {
            at
        } else {
            (f64::NAN, f64::NAN)
        });
        let events = branch.events().iter().filter(|event| event.after == place);
        points.extend(events.map(place_of));
    }
    points
}

fn place_of(event: &Event<1>) -> (f64, f64) {
    (event.point.parameter, event.point.amplitudes[0])
}

fn resonance_picture(
    curves: &[(f64, Branch<Duffing, 1>)],
    backbone: Points,
) -> Result<String, Box<dyn Error>> {
    let mut chart = Chart::new("Resonance of the hardening Duffing oscillator")
        .size(860, 540)
        .x(Axis::new("ω").range(0.7..2.8))
        .y(Axis::new("amplitude").range(0.0..2.8));
    for (k, (_, branch)) in curves.iter().enumerate() {
        let name = if k == 0 { "unstable" } else { "" };
        chart = chart.series(name, Style::Reference, part(branch, false));
    }
    for (force, branch) in curves {
        chart = chart.line(format!("F = {force}"), part(branch, true));
    }
    let folds = curves
        .iter()
        .flat_map(|(_, branch)| branch.events_of(EventKind::Fold).map(place_of));
    chart = chart
        .line("backbone", backbone)
        .series("folds", Style::Markers, folds);
    Ok(chart.to_svg()?)
}

/// The multiplier closest to a value.
fn critical(multipliers: &[Complex<f64>], value: f64) -> Complex<f64> {
    let distance = |one: &Complex<f64>| (one - value).norm();
    let nearest = multipliers
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.copied().unwrap_or(Complex::new(f64::NAN, 0.0))
}

fn fold_rows(force: f64, branch: &Branch<Duffing, 1>) -> Vec<[String; 4]> {
    let row = |fold: &Event<1>| {
        let distance = (critical(&fold.point.multipliers, 1.0) - 1.0).norm();
        let (omega, amplitude) = place_of(fold);
        [
            force.to_string(),
            format!("{omega:.10}"),
            format!("{amplitude:.6}"),
            format!("{distance:.0e}"),
        ]
    };
    branch.events_of(EventKind::Fold).map(row).collect()
}

/// Oscillations in one of the two wells over the force: responses with the period of the force, and with twice that
/// period.
struct Wells {
    single: Branch<Duffing, 1>,
    double: Branch<Duffing, 1>,
    doubling: Event<1>,
}

impl Wells {
    const OMEGA: f64 = 1.2;
    const END: f64 = 0.32;

    fn new() -> Result<Self, Box<dyn Error>> {
        let small = Duffing {
            alpha: -1.0,
            beta: 1.0,
            delta: 0.3,
            f: 0.02,
            omega: Self::OMEGA,
        };
        let single = Self::of_period(&small, 1.0)
            .guess(|_| ([1.0], [0.0]))
            .run()?;
        let doubling = single
            .events_of(EventKind::PeriodDoubling)
            .next()
            .ok_or("no period doubling")?
            .clone();
        // Just beyond the doubling: switch from the response with the period of the force to that of twice the period.
        let beyond = Duffing {
            f: doubling.point.parameter + 1e-3,
            ..small
        };
        let periods = 600.0 * TAU / Self::OMEGA;
        let settled = Simulation::new(&beyond)
            .step(TAU / Self::OMEGA / 40.0)
            .record_every(40);
        let settled = settled.run(doubling.point.start, 0.0..periods)?;
        let double = Self::of_period(&beyond, 2.0)
            .guess_from(settled.last().state())
            .run()?;
        Ok(Self {
            single,
            double,
            doubling,
        })
    }

    /// Continuation over the force of responses with the given number of periods of the force.
    fn of_period(duffing: &Duffing, periods: f64) -> Continuation<'_, Duffing, 1> {
        Continuation::of(duffing)
            .parameter(|duffing| &mut duffing.f)
            .range(duffing.f..Self::END)
            .period(move |duffing| periods * TAU / duffing.omega)
            .element(Mixed::<5>)
            .elements(60)
    }

    fn picture(&self) -> Result<String, Box<dyn Error>> {
        let chart = Chart::new("Period doubling in a double well")
            .x(Axis::new("F").range(0.0..Self::END))
            .y("amplitude")
            .series(
                "period 1, unstable",
                Style::Reference,
                part(&self.single, false),
            )
            .line("period 1", part(&self.single, true))
            .line(
                "period 2",
                [place_of(&self.doubling)]
                    .into_iter()
                    .chain(part(&self.double, true)),
            )
            .series(
                "period 2, unstable",
                Style::Reference,
                part(&self.double, false),
            );
        let doublings = [&self.single, &self.double].into_iter();
        let doublings = doublings.flat_map(|branch| branch.events_of(EventKind::PeriodDoubling));
        Ok(chart
            .series("doublings", Style::Markers, doublings.map(place_of))
            .to_svg()?)
    }
}
