//! A chain of alternating soft and stiff springs (a modified Fermi–Pasta–Ulam chain), with step sizes near resonances
//! with the stiff frequency.

use crate::{Outcome, Scene, grid};
use rayon::prelude::*;
use std::error::Error;
use tfe::charts::{Axis, Chart, Scale, Section};
use tfe::prelude::*;

/// m = 3 stiff springs of frequency ω, joined by soft quartic ones; aᵢ is the position of the middle of each stiff
/// spring, and bᵢ its extension:
///
/// ```text
/// H = ½ Σ (ȧᵢ² + ḃᵢ²) + ½ω² Σ bᵢ² + ¼ [ (a₁ − b₁)⁴ + Σ_{i<m} (aᵢ₊₁ − bᵢ₊₁ − aᵢ − bᵢ)⁴ + (aₘ + bₘ)⁴ ]
/// ```
#[dynamics(
    coordinates(a[3], b[3]),
    let soft = (a[0] - b[0])^4 + sum(i in 0..2, (a[i+1] - b[i+1] - a[i] - b[i])^4) + (a[2] + b[2])^4,
    lagrangian = sum(i in 0..3, (dot(a[i])^2 + dot(b[i])^2)/2 - omega^2/2*b[i]^2) - soft/4,
    output(stiff1) = dot(b[0])^2/2 + omega^2/2*b[0]^2,
    output(stiff2) = dot(b[1])^2/2 + omega^2/2*b[1]^2,
    output(stiff3) = dot(b[2])^2/2 + omega^2/2*b[2]^2,
)]
struct Chain {
    omega: f64,
}

const CHAIN: Chain = Chain { omega: 50.0 };
const END: f64 = 200.0;

fn start() -> State<6> {
    let one = [1.0, 0.0, 0.0];
    let [a, b] = [one, one.map(|x| x / CHAIN.omega)];
    CHAIN.state(
        [a[0], a[1], a[2], b[0], b[1], b[2]],
        [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    )
}

pub fn scene() -> Outcome {
    let elements: [Element; 4] = [
        Primal::<2>.into(),
        Mixed::<2>.into(),
        Primal::<3>.into(),
        Mixed::<3>.into(),
    ];
    let sweeps = elements.map(Sweep::of);
    let mixed = [&sweeps[1], &sweeps[3]];
    if let Some(lost) = mixed.into_iter().find(|sweep| sweep.failed > 0) {
        return Err(format!("{}: {} runs did not end", lost.element, lost.failed).into());
    }
    let failed: usize = sweeps.iter().map(|sweep| sweep.failed).sum();
    let runs: usize = sweeps.iter().map(|sweep| sweep.points.len()).sum();
    let (exchange, ripple) = exchange()?;
    let section = Section::new("A chain of stiff and soft springs through resonances")
        .paragraph(
            "Three stiff springs of frequency ω = 50 between soft quartic ones, 12 states. A \
             step with hω near π is half a period of the stiff oscillation: it shows whether \
             an element can be trusted with steps that do not resolve the stiff springs.",
        )
        .figure(
            errors(
                "Two nodes: energy error over 200 units of time",
                &sweeps[..2],
            )?,
            "Each point is the worst energy error of a whole run. Primal: the error grows with \
             hω, and beyond √12 = 3.46 no run reaches its end. Mixed, the midpoint rule: small \
             at every step.",
        )
        .figure(
            errors(
                "Three nodes: energy error over 200 units of time",
                &sweeps[2..],
            )?,
            "Primal: unstable in the bubble from √10 = 3.16 to √12, where the energy of the \
             stiff springs grows; usable again beyond it. Mixed: only small peaks at steps \
             that turn the stiff oscillation by a third (hω = 2.14) or half (√12) of a \
             revolution: resonances of the step with the quartic springs.",
        )
        .table(
            [
                "element",
                "worst energy error for hω < 3",
                "3 to 3.6",
                "above 3.6",
                "runs that ended with an error",
            ],
            sweeps.iter().map(Sweep::row),
        )
        .figure(
            exchange,
            format!(
                "The motion of the chain, with Mixed::<3> at hω = 1: the stiff springs exchange \
                 energy, while its sum remains nearly constant (here between {:.3} and {:.3}): an \
                 adiabatic invariant of the model.",
                ripple.0, ripple.1
            ),
        );
    let key = format!(
        "{runs} runs, {failed} ended with an error (primal elements beyond their limits); \
         Mixed::<3>: energy error ≤ {:.1e}",
        sweeps[3].worst(0.0, 9.0).unwrap_or(f64::NAN)
    );
    Ok(Scene { section, key })
}

/// The runs of one element with many step sizes.
struct Sweep {
    element: Element,
    /// (hω, worst relative energy error).
    points: Vec<(f64, f64)>,
    failed: usize,
}

impl Sweep {
    fn of(element: Element) -> Self {
        let count = if cfg!(debug_assertions) { 23 } else { 221 };
        let steps: Vec<f64> = grid(0.2, 4.6, count).collect();
        let run = |&step: &f64| {
            let simulation = Simulation::new(&CHAIN)
                .element(element)
                .step(step / CHAIN.omega);
            // The equations of an element far beyond its stability limit may have no solution: the point is left out,
            // and counted.
            let run = simulation.record_every(2).run(start(), 0.0..END);
            (step, run.map_or(f64::NAN, |motion| motion.energy_error()))
        };
        let points: Vec<_> = steps.par_iter().map(run).collect();
        let failed = points.iter().filter(|point| !point.1.is_finite()).count();
        Self {
            element,
            points,
            failed,
        }
    }

    /// The worst energy error of the runs that reached their end.
    fn worst(&self, from: f64, to: f64) -> Option<f64> {
        let inside = self
            .points
            .iter()
            .filter(|(step, _)| (from..to).contains(step));
        inside
            .map(|point| point.1)
            .filter(|error| error.is_finite())
            .reduce(f64::max)
    }

    fn row(&self) -> [String; 5] {
        let error = |from, to| {
            let worst = self.worst(from, to);
            worst.map_or_else(
                || "all runs failed".to_owned(),
                |worst| format!("{worst:.1e}"),
            )
        };
        [
            self.element.to_string(),
            error(0.0, 3.0),
            error(3.0, 3.6),
            error(3.6, 9.0),
            self.failed.to_string(),
        ]
    }
}

fn errors(title: &str, sweeps: &[Sweep]) -> Result<String, Box<dyn Error>> {
    let mut chart = Chart::new(title)
        .x(Axis::new("hω").range(0.0..4.6))
        .y(Axis::new("worst relative energy error")
            .scale(Scale::Logarithmic)
            .range(1e-7..1e6));
    for sweep in sweeps {
        chart = chart.line(sweep.element.to_string(), sweep.points.clone());
    }
    Ok(chart.to_svg()?)
}

/// The energies of the stiff springs over time, and the smallest and largest value of their sum.
fn exchange() -> Result<(String, (f64, f64)), Box<dyn Error>> {
    let motion = Simulation::new(&CHAIN)
        .element(Mixed::<3>)
        .step(1.0 / CHAIN.omega)
        .record_every(20)
        .run(start(), 0.0..END)?;
    let mut chart = Chart::new("Energies of the stiff springs")
        .x("t")
        .y(Axis::new("energy").range(0.0..1.5));
    let nodes = motion.states().iter();
    let over_time = |energies: Vec<f64>| nodes.clone().map(|node| node.t).zip(energies);
    let mut sum = vec![0.0; motion.states().len()];
    let springs = [
        ("first", "stiff1"),
        ("second", "stiff2"),
        ("third", "stiff3"),
    ];
    for (name, output) in springs {
        let energies = motion.outputs().column(output).ok_or(output)?;
        for (sum, energy) in sum.iter_mut().zip(&energies) {
            *sum += energy;
        }
        chart = chart.line(name, over_time(energies));
    }
    let least = sum.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = sum.iter().copied().fold(0.0, f64::max);
    let picture = chart.line("sum", over_time(sum)).to_svg()?;
    Ok((picture, (least, largest)))
}
