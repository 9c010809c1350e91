//! The quadratic form that a primal element of the oscillator conserves instead of the energy.

use crate::oscillator::{transition, unstable};
use crate::{Outcome, Scene, grid};
use std::error::Error;
use tfe::charts::{Axis, Chart, Section, Style};
use tfe::prelude::*;
use tfe::stability::TransitionError;

pub fn scene() -> Outcome {
    let error = against_closed_forms()?;
    let mixed = farthest_from_one()?;
    // Rounding errors of the entries, amplified by up to 10⁴ near the poles and zeros.
    assert!(error < 1e-9 && mixed < 1e-9, "{error:e} {mixed:e}");
    let section = Section::new("The energy that an element conserves")
        .paragraph(
            "A symplectic element of the oscillator conserves p²/2m + (kₙ/2) q² with a stiffness of \
             its own, kₙ = −a₁₂/(m a₂₁) from the entries of its transition matrix. While kₙ > 0 \
             the states of a run lie on an ellipse; if kₙ < 0 they diverge along a \
             hyperbola.",
        )
        .figure(
            stiffness(
                "Effective stiffness of the primal element",
                0.0..20.0,
                (-2.0, 3.0),
                0.0,
            )?,
            format!(
                "Two nodes: k₂/k = 1 − ρ²/12 falls to zero at √12 — the element locks. With \
                 more nodes kₙ remains close to k up to longer steps, and leaves it at pairs of poles and zeros: \
                 these are the bubbles. Mixed elements conserve the true energy, kₙ = k to {mixed:.1e}. \
                 The curves for 2, 3 and 4 nodes agree with (T-59) to {error:.1e}."
            ),
        )
        .figure(
            stiffness(
                "The first bubble, near half a period",
                3.05..3.55,
                (-4.0, 6.0),
                1.0,
            )?,
            "At half a period an element with two nodes has lost four fifths of its stiffness; \
             three nodes pass through a pole at √10 and a zero at √12, four through a bubble of \
             0.02 below √10, five through one of 0.0009: it ends where the next wider one \
             begins.",
        )
        .figure(
            orbits(3, &[1.0, 2.5, 3.0, 3.13, 3.3, 4.0, 6.0, 7.5])?,
            "Three nodes: the orbits for several steps ρ, all from p = 1, q = 0. The circle belongs \
             to ρ → 0. Towards √10 = 3.162 the ellipse collapses, inside the bubble (ρ = 3.3) \
             it opens into a hyperbola, beyond it there is an elongated ellipse, which towards √60 = 7.746 \
             grows without bound.",
        );
    let key = format!("kₙ/k by (T-59) to {error:.1e}; mixed: |k/kₙ − 1| ≤ {mixed:.1e}");
    Ok(Scene { section, key })
}

/// kₙ/k at m = k = 1, from the entries of the transition matrix (T-58).
fn kept(element: Element, rho: f64) -> Result<f64, TransitionError> {
    let a = transition(element, rho)?;
    Ok(-a[(0, 1)] / a[(1, 0)])
}

/// kₙ/k over ρ, with a gap at each pole.
fn stiffness(
    title: &str,
    range: std::ops::Range<f64>,
    (low, high): (f64, f64),
    fine: f64,
) -> Result<String, Box<dyn Error>> {
    let mut chart = Chart::new(title)
        .x(Axis::new("ρ = ωh").range(range.clone()))
        .y(Axis::new("kₙ/k").range(low..high));
    for nodes in 2..=5 {
        let element = Element::primal(nodes);
        let mut places: Vec<f64> = grid(range.start.max(0.01), range.end, 2001).collect();
        if fine > 0.0 {
            for bubble in unstable(element, range.end)? {
                places.extend(grid(bubble.start - 1e-4, bubble.end + 1e-4, 2001));
            }
            places.sort_by(f64::total_cmp);
        }
        let mut points: Vec<(f64, f64)> = Vec::new();
        for rho in places {
            let value = kept(element, rho)?;
            if points
                .last()
                .is_some_and(|(_, before)| (before - value).abs() > high - low)
            {
                points.push((f64::NAN, f64::NAN));
            }
            points.push((rho, value));
        }
        chart = chart.line(format!("{nodes} nodes"), points);
    }
    let one = [(range.start, 1.0), (range.end, 1.0)];
    Ok(chart.line("mixed, any nodes", one).to_svg()?)
}

/// The largest relative difference from (T-59), except near the poles; NaN if one is (`total_cmp` treats it as the
/// largest number).
fn against_closed_forms() -> Result<f64, TransitionError> {
    let mut errors: Vec<f64> = Vec::new();
    for rho in grid(0.1, 20.0, 400) {
        let x = rho * rho;
        let closed = [
            1.0 - x / 12.0,
            (1.0 - x / 12.0) * (1.0 - x / 60.0) / (1.0 - x / 10.0),
            (1.0 - x / 60.0) * (1.0 - 180.0 * x / 1680.0 + x * x / 1680.0)
                / ((1.0 - x / 10.0) * (1.0 - x / 42.0)),
        ];
        for (nodes, closed) in (2..).zip(closed) {
            let error = (kept(Element::primal(nodes), rho)? / closed - 1.0).abs();
            errors.push(error);
        }
    }
    Ok(errors
        .into_iter()
        .max_by(f64::total_cmp)
        .unwrap_or(f64::NAN))
}

/// The largest |k/kₙ − 1| for mixed elements with 2 to 6 nodes.
fn farthest_from_one() -> Result<f64, TransitionError> {
    let mut errors: Vec<f64> = Vec::new();
    for rho in grid(0.1, 20.0, 400) {
        for nodes in 2..=6 {
            errors.push((1.0 / kept(Element::mixed(nodes), rho)? - 1.0).abs());
        }
    }
    Ok(errors
        .into_iter()
        .max_by(f64::total_cmp)
        .unwrap_or(f64::NAN))
}

/// The orbits p² + (kₙ/k) q² = 1 of a primal element.
fn orbits(nodes: usize, steps: &[f64]) -> Result<String, Box<dyn Error>> {
    let mut chart = Chart::new(format!("Orbits of the primal element with {nodes} nodes"))
        .size(720, 520)
        .x(Axis::new("q √(km) / p₀").range(-3.0..3.0))
        .y(Axis::new("p / p₀").range(-2.0..2.0));
    let circle = grid(0.0, std::f64::consts::TAU, 181).map(|angle| (angle.sin(), angle.cos()));
    chart = chart.series("ρ → 0", Style::Reference, circle);
    for &rho in steps {
        let stiffness = kept(Element::primal(nodes), rho)?;
        chart = chart.line(format!("ρ = {rho}"), conic(stiffness));
    }
    Ok(chart.to_svg()?)
}

/// The curve p² + k q² = 1 as points (q, p).
fn conic(k: f64) -> Vec<(f64, f64)> {
    let root = k.abs().sqrt();
    if k > 0.0 {
        let angles = grid(0.0, std::f64::consts::TAU, 361);
        return angles
            .map(|angle| (angle.sin() / root, angle.cos()))
            .collect();
    }
    let branch = |sign: f64| {
        let arguments = grid(-4.0, 4.0, 201);
        arguments.map(move |u| (u.sinh() / root, sign * u.cosh()))
    };
    branch(1.0)
        .chain([(f64::NAN, f64::NAN)])
        .chain(branch(-1.0))
        .collect()
}
