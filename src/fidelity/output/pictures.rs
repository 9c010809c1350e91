//! Charts and sections of pages for model comparisons.

use super::HEADINGS;
use crate::charts::{Axis, Chart, ChartError, Scale, Section, Style};
use crate::fidelity::{Choice, Ladder, Rung};

/// Runs with a larger error have lost the motion, and are not drawn.
const LOST: f64 = 10.0;

impl Ladder {
    /// A chart of cost against error, both logarithmic: the Pareto front of each model, and a vertical line where the
    /// error of the model ends it. The legend gives the errors of the models and the number of runs that failed.
    pub fn chart(&self) -> Chart {
        let logarithmic = |label: &str| Axis::new(label).scale(Scale::Logarithmic);
        let mut chart = Chart::new(&self.title)
            .x(logarithmic("largest relative error of the outputs"))
            .y(logarithmic(self.cost.label()))
            .size(900, 560);
        for rung in &self.rungs {
            let front = self.places(rung);
            if !front.is_empty() {
                chart = chart.series(name(rung), Style::LineWithMarkers, front);
            }
        }
        let all = || self.rungs.iter().flat_map(|rung| self.places(rung));
        let costs = all().map(|place| place.1).filter(|cost| *cost > 0.0);
        let (least, most) = costs.fold((f64::INFINITY, 0.0_f64), |(least, most), cost| {
            (least.min(cost), most.max(cost))
        });
        if least < most {
            let ends = |error| [(error, least), (error, most)];
            let errors = self.rungs.iter().filter_map(|rung| rung.model_error);
            let drawn = errors.filter(|error| *error < LOST);
            // One legend entry for all, since they look the same.
            let names = std::iter::once("errors of models").chain(std::iter::repeat(""));
            for (error, name) in drawn.zip(names) {
                chart = chart.series(name, Style::Reference, ends(error));
            }
        }
        chart
    }

    /// The errors and costs of the most efficient runs (Pareto front) of a rung.
    fn places(&self, rung: &Rung) -> Vec<(f64, f64)> {
        let place = |one: &Choice| (one.error, one.cost(self.cost));
        let front = rung.front(self.cost);
        let drawn = front.into_iter().filter(|one| one.error < LOST);
        drawn.map(place).collect()
    }

    /// A section of a page: what was compared, the chart, a table of choices and a table of models.
    ///
    /// # Errors
    /// [`ChartError::NoData`] if no run reached its end.
    pub fn section(&self) -> Result<Section, ChartError> {
        let text = format!(
            "Errors are the largest of the outputs ({}), each relative to its largest value. Reference: the last rung, {}. Times are of the steps \
             alone, on one processor, the best of several runs.",
            self.outputs.join(", "),
            self.reference
        );
        let choices = self.accuracies.iter().map(|accuracy| self.row(*accuracy));
        let rung = |rung: &Rung| {
            let error = rung.model_error;
            [
                rung.name.clone(),
                error.map_or_else(|| "—".to_owned(), |error| format!("{error:.1e}")),
                rung.points.len().to_string(),
                rung.failed().to_string(),
            ]
        };
        Ok(Section::new(&self.title)
            .paragraph(text)
            .figure(self.chart().to_svg()?, &self.title)
            .table(HEADINGS, choices)
            .table(
                ["rung", "model error", "runs", "failed"],
                self.rungs.iter().map(rung),
            ))
    }
}

/// The name of a rung in the legend.
fn name(rung: &Rung) -> String {
    let mut name = rung.name.clone();
    if let Some(error) = rung.model_error {
        name += &format!(", model error {error:.1e}");
    }
    match rung.failed() {
        0 => name,
        failed => format!("{name}, {failed} failed"),
    }
}
