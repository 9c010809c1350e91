//! The speed at which an upright top becomes stable: the exact one, and that of the discretised equations.

use crate::{Outcome, Scene, grid};
use nalgebra::DMatrix;
use std::error::Error;
use tfe::Family;
use tfe::charts::{Axis, Chart, Scale, Section, Style};
use tfe::prelude::*;
use tfe::stability::{TransitionError, unstable_intervals_of};

/// Small tilts φ₁, φ₂ of a symmetric top that spins upright at Ω, (T-84) in real form:
///
/// ```text
/// J_t φ̈₁ + J_a Ω φ̇₂ = mgd φ₁ ,     J_t φ̈₂ − J_a Ω φ̇₁ = mgd φ₂
/// ```
#[dynamics(
    coordinates(phi1, phi2),
    lagrangian = jt/2*(dot(phi1)^2 + dot(phi2)^2) + ja*omega/2*(phi2*dot(phi1) - phi1*dot(phi2)) + mgd/2*(phi1^2 + phi2^2),
)]
struct Top {
    jt: f64,
    ja: f64,
    mgd: f64,
    omega: f64,
}

/// Ω_c = (2/J_a) √(mgd J_t) = 1, and σ = mgd h²/J_t = h².
const fn spinning_at(omega: f64) -> Top {
    Top {
        jt: 1.0,
        ja: 2.0,
        mgd: 1.0,
        omega,
    }
}

/// (Ω/Ω_c)² as a function of σ.
type ClosedForm = fn(f64) -> f64;

/// The limit of stability of the discretised upright top, as a speed over the step h√(mgd/J_t).
struct Curve {
    name: &'static str,
    element: Element,
    closed: Option<ClosedForm>,
    /// (h, limit): unstable below the limit.
    limits: Vec<(f64, f64)>,
    /// (h, speed): the ends of further unstable intervals.
    bands: Vec<(f64, f64)>,
}

const STEPS: usize = 30;
const LONGEST: f64 = 6.0;

pub fn scene() -> Outcome {
    let two = |s: f64| 1.0 + s / 12.0;
    let three = |s: f64| (1.0 + s / 12.0) * (1.0 + s / 60.0) / (1.0 + s / 10.0);
    let exact: ClosedForm = |_| 1.0;
    let curves = [
        Curve::of("primal, 2 nodes", Primal::<2>, Some(two))?,
        Curve::of("primal, 3 nodes", Primal::<3>, Some(three))?,
        Curve::of("primal, 4 nodes", Primal::<4>, None)?,
        Curve::of(
            "primal reduced, 3 nodes",
            Primal::<3>.reduced(),
            Some(exact),
        )?,
        Curve::of("mixed, 2 nodes", Mixed::<2>, Some(exact))?,
        Curve::of("mixed, 3 nodes", Mixed::<3>, Some(exact))?,
        Curve::of(
            "energy-conserving, 3 nodes",
            EnergyConserving::<3>,
            Some(exact),
        )?,
        Curve::of("primal Lobatto, 3 nodes", Primal::<3>.lobatto(), None)?,
        Curve::of("Radau, 3 nodes", Radau::<3>, None)?,
    ];
    let errors = curves.iter().filter_map(Curve::error);
    let worst = errors.max_by(f64::total_cmp).ok_or("no closed form")?;
    assert!(worst < 1e-9, "a limit speed has an error of {worst:e}");
    let section = Section::new("The spinning top: from which speed on is it stable?")
        .paragraph(
            "A top stands upright in a stable way above Ω_c = (2/J_a)√(mgd J_t). An element with a stiffness of \
             its own changes that limit. The limits below are found by root finding over Ω, one \
             for each step size.",
        )
        .figure(
            limits(&curves)?,
            "Dashed: the closed forms (T-87), (T-88); markers: found by root finding. With two primal nodes the \
             top seems to need twice Ω_c at h√(mgd/J_t) = 6, with three 1.18 Ω_c; reduced and \
             mixed elements have the exact limit at every step. Four primal nodes have, \
             besides, a band of instability 0.02 wide far above the limit, where two \
             multipliers of the element collide; the top itself is stable there. Radau elements \
             have numerical damping, which makes the top seem stable at some speeds below Ω_c.",
        )
        .figure(
            deviations(&curves)?,
            "The relative error of the limit. Slopes of 2, 4 and 6 are the orders of the elements. The \
             errors of reduced and mixed elements are rounding.",
        )
        .table(
            [
                "element",
                "limit at h√(mgd/J_t) = 6",
                "closed form",
                "largest relative error over all steps",
            ],
            curves.iter().map(Curve::row),
        );
    let key = format!("limit speeds agree with closed forms to {worst:.1e}");
    Ok(Scene { section, key })
}

impl Curve {
    fn of(
        name: &'static str,
        element: impl Into<Element>,
        closed: Option<ClosedForm>,
    ) -> Result<Self, Box<dyn Error>> {
        let element = element.into();
        let mut curve = Self {
            name,
            element,
            closed,
            limits: Vec::new(),
            bands: Vec::new(),
        };
        for h in grid(LONGEST / STEPS as f64, LONGEST, STEPS) {
            let intervals = unstable_intervals_of(|omega| upright(element, omega, h), 0.1..2.5)?;
            let Some((below, bands)) = intervals.split_first() else {
                // The damping of Radau elements hides the instability of the top itself.
                if element.family() == Family::Radau {
                    continue;
                }
                return Err(format!("{element}, h = {h}: stable below the critical speed").into());
            };
            curve.limits.push((h, below.end));
            curve.bands.extend(
                bands
                    .iter()
                    .flat_map(|band| [(h, band.start), (h, band.end)]),
            );
        }
        Ok(curve)
    }

    fn expected(&self, h: f64) -> Option<f64> {
        self.closed.map(|closed| closed(h * h).sqrt())
    }

    /// The largest relative difference from the closed form.
    fn error(&self) -> Option<f64> {
        let error = |(h, limit): &(f64, f64)| Some((limit / self.expected(*h)? - 1.0).abs());
        let errors = self.limits.iter().filter_map(error);
        errors.max_by(f64::total_cmp)
    }

    fn row(&self) -> [String; 4] {
        let last = self.limits.last().map_or(f64::NAN, |point| point.1);
        let none = || "—".to_owned();
        [
            self.element.to_string(),
            format!("{last:.12} Ω_c"),
            self.expected(LONGEST)
                .map_or_else(none, |speed| format!("{speed:.12} Ω_c")),
            self.error()
                .map_or_else(none, |error| format!("{error:.0e}")),
        ]
    }
}

/// The transition matrix for small tilts of the upright top that spins at Ω.
fn upright(element: Element, omega: f64, h: f64) -> Result<DMatrix<f64>, TransitionError> {
    let top = spinning_at(omega);
    let upright = top.state([0.0; 2], [0.0; 2]);
    stability::transition_matrix(&top, element, &upright, 0.0, h)
}

fn limits(curves: &[Curve]) -> Result<String, Box<dyn Error>> {
    let mut chart = Chart::new("Limit speed of the top")
        .x(Axis::new("h √(mgd/J_t)").range(0.0..LONGEST + 0.1))
        .y(Axis::new("limit Ω/Ω_c").range(0.0..2.5));
    for (curve, name) in curves.iter().zip(["closed forms", ""]) {
        let closed = grid(0.0, LONGEST, 121).filter_map(|h| Some((h, curve.expected(h)?)));
        chart = chart.series(name, Style::Reference, closed);
    }
    for curve in curves {
        chart = chart.series(curve.name, Style::Markers, curve.limits.iter().copied());
    }
    for curve in curves.iter().filter(|curve| !curve.bands.is_empty()) {
        let name = format!("{}: band", curve.name);
        chart = chart.series(name, Style::Markers, curve.bands.iter().copied());
    }
    Ok(chart.to_svg()?)
}

fn deviations(curves: &[Curve]) -> Result<String, Box<dyn Error>> {
    let mut chart = Chart::new("Limit speed: relative error")
        .x(Axis::new("h √(mgd/J_t)")
            .scale(Scale::Logarithmic)
            .range(0.19..6.2))
        .y(Axis::new("|Ω/Ω_c − 1|")
            .scale(Scale::Logarithmic)
            .range(1e-16..2.0));
    for curve in curves {
        let points = curve
            .limits
            .iter()
            .map(|(h, limit)| (*h, (limit - 1.0).abs()));
        chart = chart.series(curve.name, Style::Markers, points);
    }
    Ok(chart.to_svg()?)
}
