//! Estimated errors compared with true ones.

use crate::Scene;
use crate::truth::Truth;
use tfe::charts::{Axis, Chart, ChartError, Scale, Section, Style};
use tfe::prelude::*;

/// The range of errors that are compared: below, rounding errors of the reference show; above, the run has nothing to
/// do with the motion.
const ERRORS: std::ops::Range<f64> = 1e-12..3e-2;

/// One run.
pub struct Point {
    error: f64,
    estimate: f64,
}

impl Point {
    fn is_good(&self) -> bool {
        (0.5..=2.0).contains(&(self.estimate / self.error))
    }
}

/// Runs with elements of all families and step sizes from long to short.
pub fn measure<M: Model<N>, const N: usize>(model: &M, truth: &Truth<N>) -> Vec<Point> {
    let elements = [
        Element::primal(3),
        Element::primal(4).lobatto(),
        Element::mixed(3),
        Element::mixed(5),
        Element::mixed(9),
        Element::energy_conserving(3),
        Element::radau(4),
        Element::three_field(4),
    ];
    let counts = [10, 20, 40, 80, 160, 320, 640, 1280];
    let counts = if cfg!(debug_assertions) {
        &counts[2..5]
    } else {
        &counts[..]
    };
    let mut points = Vec::new();
    for element in elements {
        for &count in counts {
            let step = truth.end / f64::from(count);
            let simulation = Simulation::new(model).element(element).step(step);
            let span = 0.0..truth.end;
            // Steps that are too long to be solved have no error.
            let Ok(motion) = simulation.run_estimated(truth.start, span) else {
                continue;
            };
            let error = truth.error(motion.last());
            if let Some((_, estimate)) = motion.error_estimates().last()
                && ERRORS.contains(&error)
            {
                points.push(Point { error, estimate });
            }
        }
    }
    points
}

fn row(scene: &Scene) -> [String; 5] {
    let points = &scene.estimates;
    let ratios = || points.iter().map(|point| point.estimate / point.error);
    let good = points.iter().filter(|point| point.is_good()).count();
    [
        scene.title.to_owned(),
        points.len().to_string(),
        format!("{:.1} %", 100.0 * good as f64 / points.len() as f64),
        format!("{:.2}", ratios().fold(f64::INFINITY, f64::min)),
        format!("{:.2}", ratios().fold(0.0, f64::max)),
    ]
}

/// A line of the printed table.
pub fn line(scene: &Scene) -> String {
    let [title, points, good, least, most] = row(scene);
    format!(
        "{title}: {good} of {points} estimates within a factor of two of the true error; ratios {least} to {most}"
    )
}

/// The table and the chart.
pub fn section(scenes: &[Scene]) -> Result<Section, ChartError> {
    let all = || scenes.iter().flat_map(|scene| &scene.estimates);
    let (good, count) = (all().filter(|point| point.is_good()).count(), all().count());
    println!(
        "\nthe estimate is within a factor of two of the true error for {good} of {count} runs\n"
    );
    let mut chart = Chart::new("Estimated and true errors at the end of the span")
        .x(Axis::new("true error").scale(Scale::Logarithmic))
        .y(Axis::new("estimated error").scale(Scale::Logarithmic));
    for scene in scenes {
        let points = scene.estimates.iter();
        let points = points.map(|point| (point.error, point.estimate));
        chart = chart.series(scene.title, Style::Markers, points);
    }
    let (first, last) = (ERRORS.start, ERRORS.end);
    for (name, factor) in [("half", 0.5), ("twice", 2.0)] {
        let line = [(first, factor * first), (last, factor * last)];
        chart = chart.series(name, Style::Reference, line);
    }
    Ok(Section::new("Estimated errors")
        .paragraph(format!(
            "The estimate is the difference from a run with an element of one node more. Errors at the end of the span, relative to the largest coordinate or momentum, between {first:.0e} and {last:.0e}, of eight \
             elements of all families with 10 to 1280 steps. {good} of {count} estimates are within a factor of two.",
        ))
        .figure(chart.to_svg()?, "Estimates and true errors")
        .table(
            ["scene", "runs", "within a factor of two", "smallest ratio", "largest ratio"],
            scenes.iter().map(row),
        ))
}
