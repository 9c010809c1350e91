//! The time to compute a periodic orbit over the number of its elements.

use crate::work::VanDerPol;
use crate::{Outcome, Scene};
use std::error::Error;
use std::time::Instant;
use tfe::charts::{Axis, Chart, Scale, Section, Style};
use tfe::prelude::*;

const ELEMENTS: [usize; 7] = [10, 30, 100, 300, 1000, 3000, 10_000];

struct Cost {
    elements: usize,
    /// Seconds.
    time: f64,
    iterations: u64,
}

pub fn scene() -> Outcome {
    let costs = ELEMENTS
        .iter()
        .map(|&elements| cost(elements))
        .collect::<Result<Vec<_>, _>>()?;
    let (all, large) = (exponent(&costs), exponent(&costs[2..]));
    let points = costs
        .iter()
        .map(|cost| (cost.elements as f64, 1e3 * cost.time));
    let middle = &costs[costs.len() / 2];
    let proportional = |elements: f64| (elements, 1e3 * middle.per_element() * elements);
    let picture = Chart::new("Van der Pol's limit cycle with Mixed::<4>: time of a solution")
        .x(Axis::new("elements")
            .scale(Scale::Logarithmic)
            .range(8.0..13_000.0))
        .y(Axis::new("time (ms)").scale(Scale::Logarithmic))
        .series(
            "proportional",
            Style::Reference,
            [proportional(10.0), proportional(1e4)],
        )
        .series("measured", Style::LineWithMarkers, points)
        .to_svg()?;
    let rows = costs.iter().map(Cost::row);
    let last = costs.last().map_or(f64::NAN, Cost::per_element);
    let section = Section::new("Cost over the number of elements")
        .figure(
            picture,
            format!(
                "From ten elements to ten thousand: the exponent of a straight line through the \
                 points is {all:.3}, and {large:.3} from a hundred elements on, where what a \
                 fixed costs no longer matter. The equations of all elements are \
                 eliminated one after the other, and the multipliers come from the factors, so \
                 that the cost is linear in their number."
            ),
        )
        .table(
            [
                "elements",
                "time (ms)",
                "iterations of Newton's method",
                "time per element (µs)",
                "per element and iteration (µs)",
            ],
            rows,
        );
    let key = format!(
        "time ∝ elements^{all:.3}, from 100 on ^{large:.3}; {:.2} µs per element",
        1e6 * last
    );
    Ok(Scene { section, key })
}

fn cost(elements: usize) -> Result<Cost, Box<dyn Error>> {
    let model = VanDerPol { mu: 1.0 };
    let cycle = PeriodicOrbit::of(&model)
        .elements(elements)
        .unknown_period(6.3);
    let cycle = cycle.guess(|t| ([2.0 * t.cos()], [-2.0 * t.sin()]));
    let mut times = Vec::new();
    let mut iterations = 0;
    for _ in 0..5 {
        let clock = Instant::now();
        let orbit = cycle.solve()?;
        times.push(clock.elapsed().as_secs_f64());
        iterations = orbit.statistics().newton_iterations;
    }
    times.sort_by(f64::total_cmp);
    Ok(Cost {
        elements,
        time: times[times.len() / 2],
        iterations,
    })
}

impl Cost {
    fn per_element(&self) -> f64 {
        self.time / self.elements as f64
    }

    fn row(&self) -> [String; 5] {
        let per_element = 1e6 * self.per_element();
        [
            self.elements.to_string(),
            format!("{:.3}", 1e3 * self.time),
            self.iterations.to_string(),
            format!("{per_element:.2}"),
            format!("{:.2}", per_element / self.iterations as f64),
        ]
    }
}

/// The slope of the straight line through (ln elements, ln time), by least squares.
fn exponent(costs: &[Cost]) -> f64 {
    let points: Vec<_> = costs
        .iter()
        .map(|cost| ((cost.elements as f64).ln(), cost.time.ln()))
        .collect();
    let count = points.len() as f64;
    let mean_x = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mean_y = points.iter().map(|point| point.1).sum::<f64>() / count;
    let covariance: f64 = points
        .iter()
        .map(|(x, y)| (x - mean_x) * (y - mean_y))
        .sum();
    let variance: f64 = points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    covariance / variance
}
