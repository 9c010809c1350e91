//! Charts and sections of pages for work-precision diagrams.

use crate::charts::{Axis, Chart, ChartError, Scale, Section, Style};
use crate::numbers::larger;
use crate::work_precision::peer::{PeerMeasured, PeerPoint};
use crate::work_precision::point::Measured;
use crate::work_precision::{Curve, Measurements, Point};

/// The value at which errors of zero are drawn: half an ulp.
const MIN: f64 = 0.5 * f64::EPSILON;

impl Measurements {
    /// A chart of the error at the end (the larger one of coordinates and momenta) against cost, both logarithmic: a
    /// line for each curve with its observed order, and for each other integrator; the Pareto front of the elements as
    /// a dashed line; a different marker at points below the uncertainty of the reference. The legend gives the number
    /// of runs that failed; errors above ten are cut off.
    pub fn chart(&self) -> Chart {
        let logarithmic = |label: &str| Axis::new(label).scale(Scale::Logarithmic);
        let mut chart = Chart::new(&self.title)
            .x(logarithmic(self.cost.label()))
            .y(self.errors(logarithmic("relative error at the end")))
            .size(900, 560);
        for curve in &self.curves {
            let place = |one: &Measured| (one.cost(self.cost), larger(one.error(), MIN));
            let points = curve.measured().map(|(_, one)| place(one));
            chart = chart.series(self.name(curve), Style::LineWithMarkers, points);
        }
        for peer in &self.peers {
            let place = |one: &PeerMeasured| Some((one.cost(self.cost)?, larger(one.error(), MIN)));
            let points = peer.points.iter().filter_map(PeerPoint::measured);
            let points: Vec<_> = points.filter_map(place).collect();
            if !points.is_empty() {
                let name = with_failures(peer.name().to_owned(), peer.failed());
                chart = chart.series(name, Style::LineWithMarkers, points);
            }
        }
        let unsure = self.below_reference();
        if !unsure.is_empty() {
            chart = chart.series("at the floor of the reference", Style::Markers, unsure);
        }
        let front = self.steps_of_front();
        if front.len() > 1 {
            chart = chart.series(
                "least cost for an error",
                Style::Reference,
                front.iter().copied(),
            );
        }
        let uncertainty = self.reference.uncertainty();
        let costs = self.points().filter_map(|point| point.cost(self.cost));
        let (least, most) = costs.fold((f64::INFINITY, 0.0_f64), |(least, most), cost| {
            (least.min(cost), most.max(cost))
        });
        let seen = self.points().any(|point| {
            let error = point.error();
            error.is_some_and(|error| error <= 100.0 * uncertainty)
        });
        if seen && least < most {
            let ends = [(least, uncertainty), (most, uncertainty)];
            chart = chart.series("uncertainty of reference", Style::Reference, ends);
        }
        chart
    }

    /// The axis of errors, limited so that runs that diverged without failing do not compress all others.
    fn errors(&self, axis: Axis) -> Axis {
        const LOST: f64 = 10.0;
        let errors = || {
            let peers = self.peers.iter().flat_map(|peer| &peer.points);
            let peers = peers.filter_map(|point| Some(point.measured()?.error()));
            self.points().filter_map(Point::error).chain(peers)
        };
        if !errors().any(|error| error > LOST) {
            return axis;
        }
        let least = errors().fold(LOST, f64::min).max(MIN);
        axis.range(0.5 * least.min(0.1 * LOST)..LOST)
    }

    /// A section of a page: how the measurements were made, the chart, a table of the curves.
    ///
    /// # Errors
    /// [`ChartError::NoData`] if no run reached its end.
    pub fn section(&self) -> Result<Section, ChartError> {
        let failed = self.failures().count();
        let mut text = format!(
            "Errors at the end of the run are relative to the largest state, the larger one of coordinates and momenta. Reference: {}. \
             Times are of the steps alone, on one processor, the best of several runs.",
            self.reference
        );
        if failed > 0 {
            text += &format!(" {failed} runs failed and are not drawn.");
        }
        Ok(Section::new(&self.title)
            .paragraph(text)
            .figure(self.chart().to_svg()?, &self.title)
            .table(
                [
                    "element",
                    "solver",
                    "order",
                    "slope of q",
                    "slope of p",
                    "floor",
                    "least error",
                    "energy",
                    "constraints",
                    "failed",
                ],
                self.curves.iter().map(|curve| self.row(curve)),
            ))
    }

    fn row(&self, curve: &Curve) -> [String; 10] {
        let dash = || "—".to_owned();
        let slope = |slope: Option<crate::work_precision::Slope>| {
            slope.map_or_else(dash, |slope| format!("{:.2}", slope.exponent))
        };
        let least = |of: fn(&Measured) -> f64| {
            let values = curve.measured().map(|(_, one)| of(one));
            values
                .reduce(f64::min)
                .map_or_else(dash, |value| format!("{value:.1e}"))
        };
        [
            curve.element().to_string(),
            format!("{:?}", curve.solve()),
            curve.element().order().to_string(),
            slope(curve.slope_q()),
            slope(curve.slope_p()),
            curve
                .floor()
                .map_or_else(dash, |floor| format!("{floor:.1e}")),
            least(Measured::error),
            least(|one| one.energy_error),
            if self.constrained {
                least(|one| one.constraint_position.max(one.constraint_velocity))
            } else {
                dash()
            },
            curve.failed().to_string(),
        ]
    }

    /// The name of a curve in the legend.
    fn name(&self, curve: &Curve) -> String {
        let mut name = curve.element().to_string();
        let first = self.curves.first().map(Curve::solve);
        if self.curves.iter().any(|other| Some(other.solve()) != first) {
            name += &format!(", {:?}", curve.solve());
        }
        if let Some(slope) = curve.slope() {
            name += &format!(" ~ h^{:.1}", slope.exponent);
        }
        with_failures(name, curve.failed())
    }

    /// The region where errors are below the uncertainty of the reference.
    fn below_reference(&self) -> Vec<(f64, f64)> {
        let ours = self.points().filter_map(Point::measured);
        let ours = ours.filter(|one| one.at_reference_floor);
        let ours = ours.map(|one| (one.cost(self.cost), larger(one.error(), MIN)));
        let peers = self.peers.iter().flat_map(|peer| &peer.points);
        let peers = peers.filter_map(PeerPoint::measured);
        let peers = peers.filter(|one| one.at_reference_floor);
        let peers = peers.filter_map(|one| Some((one.cost(self.cost)?, larger(one.error(), MIN))));
        ours.chain(peers).collect()
    }

    /// The Pareto front as a step function: the least error up to each cost.
    fn steps_of_front(&self) -> Vec<(f64, f64)> {
        let mut line = Vec::new();
        let mut last = None;
        for point in self.front() {
            let Some((cost, _)) = self.place(point) else {
                continue;
            };
            let error = point.error().unwrap_or(MIN).max(MIN);
            line.extend(last.map(|last| (cost, last)));
            line.push((cost, error));
            last = Some(error);
        }
        line
    }
}

fn with_failures(name: String, failed: usize) -> String {
    match failed {
        0 => name,
        failed => format!("{name}, {failed} failed"),
    }
}
