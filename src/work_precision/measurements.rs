//! The results of a work-precision comparison.

use super::fit::{self, Slope};
use super::peer::{Peer, PeerPoint};
use super::point::{Cost, Measured, Point};
use super::reference::Reference;
use tfe_runtime::{Element, Solve};

/// The runs with one element and one solver, the longest step first.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    points: Vec<Point>,
    uncertainty: f64,
    element: Element,
    solve: Solve,
}

impl Curve {
    /// A curve of at least one point.
    pub(super) fn new(points: Vec<Point>, uncertainty: f64) -> Self {
        let (element, solve) = points.first().map_or_else(
            || (Element::mixed(2), Solve::Auto),
            |point| (point.element, point.solve),
        );
        Self {
            points,
            uncertainty,
            element,
            solve,
        }
    }

    /// The element.
    pub fn element(&self) -> Element {
        self.element
    }

    /// How the equations of the element were solved.
    pub fn solve(&self) -> Solve {
        self.solve
    }

    /// All runs, including those that failed, the longest step first.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The runs that reached the end of the span: step size and measurements.
    pub fn measured(&self) -> impl Iterator<Item = (f64, &Measured)> {
        let points = self.points.iter();
        points.filter_map(|point| Some((point.step, point.measured()?)))
    }

    /// The number of runs that failed.
    pub fn failed(&self) -> usize {
        self.points.len() - self.measured().count()
    }

    /// The observed order: the power of the step size by which the error at the end falls, where the error is the
    /// larger one of coordinates and momenta. `None` if fewer than two points follow a power law.
    pub fn slope(&self) -> Option<Slope> {
        self.slope_of(Measured::error)
    }

    /// The observed order of the coordinates alone.
    pub fn slope_q(&self) -> Option<Slope> {
        self.slope_of(|measured| measured.error_q)
    }

    /// The observed order of the momenta alone.
    pub fn slope_p(&self) -> Option<Slope> {
        self.slope_of(|measured| measured.error_p)
    }

    /// The error that shorter steps do not improve (rounding, iteration); `None` if no step was short enough to show
    /// it.
    pub fn floor(&self) -> Option<f64> {
        fit::floor(&self.errors(Measured::error))
    }

    /// The fastest run with an error of at most `error`; `None` if there is none, or `error` is below the uncertainty
    /// of the reference.
    pub fn fastest(&self, error: f64) -> Option<&Point> {
        cheapest(self.points.iter(), error, self.uncertainty, Cost::Time)
    }

    fn slope_of(&self, error: impl Fn(&Measured) -> f64) -> Option<Slope> {
        fit::slope(&self.errors(error), self.uncertainty)
    }

    fn errors(&self, error: impl Fn(&Measured) -> f64) -> Vec<(f64, f64)> {
        let errors = self.measured();
        errors.map(|(step, one)| (step, error(one))).collect()
    }
}

/// The measurements of a [`WorkPrecision`](super::WorkPrecision): curves of points, the reference, and the Pareto
/// front.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurements {
    pub(super) title: String,
    pub(super) constrained: bool,
    pub(super) curves: Vec<Curve>,
    pub(super) peers: Vec<Peer>,
    pub(super) reference: Reference,
    pub(super) cost: Cost,
}

impl Measurements {
    /// One curve for every element and solver, in the order in which they were asked for.
    pub fn curves(&self) -> &[Curve] {
        &self.curves
    }

    /// All runs, including those that failed, curve by curve.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.curves.iter().flat_map(|curve| &curve.points)
    }

    /// The runs that failed.
    pub fn failures(&self) -> impl Iterator<Item = &Point> {
        self.points().filter(|point| point.outcome.is_err())
    }

    /// The curves of other integrators, in the order in which they were asked for.
    pub fn peers(&self) -> &[Peer] {
        &self.peers
    }

    /// The reference against which errors were measured.
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// Changes the measure of cost for charts and for the Pareto front.
    #[must_use]
    pub fn against(mut self, cost: Cost) -> Self {
        self.cost = cost;
        self
    }

    /// Changes the title.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// The measurements with only some of the curves, for a chart of their own; the curves of other integrators stay.
    #[must_use]
    pub fn only(&self, wanted: impl Fn(&Curve) -> bool) -> Self {
        let curves = self.curves.iter().filter(|curve| wanted(curve));
        Self {
            curves: curves.cloned().collect(),
            peers: self.peers.clone(),
            title: self.title.clone(),
            ..*self
        }
    }

    /// The measurements without the other integrators.
    #[must_use]
    pub fn without_peers(mut self) -> Self {
        self.peers.clear();
        self
    }

    /// The Pareto front of the elements: the runs for which no other has both a smaller error and a smaller cost, the
    /// cheapest first.
    ///
    /// An error below the uncertainty of the reference counts as that uncertainty.
    pub fn front(&self) -> Vec<&Point> {
        // (cost, error, point), for points with both numbers.
        let known = |point| {
            let (cost, error) = self.place(point)?;
            (cost.is_finite() && error.is_finite()).then_some((cost, error, point))
        };
        let all = self.points().filter_map(known).collect();
        pareto(all).into_iter().map(|(_, _, point)| point).collect()
    }

    /// The cheapest run with an error of at most `error`; `None` if there is none, or if `error` is below the
    /// uncertainty of the reference, because such an error cannot be measured.
    pub fn fastest(&self, error: f64) -> Option<&Point> {
        let uncertainty = self.reference.uncertainty();
        cheapest(self.points(), error, uncertainty, self.cost)
    }

    /// The Pareto front of the other integrators alone, as (cost, error), the cheapest first.
    pub fn front_of_peers(&self) -> Vec<(f64, f64)> {
        let points = self.peers.iter().flat_map(|peer| &peer.points);
        let places = points.filter_map(|point| {
            let one = point.measured()?;
            let (cost, error) = (one.cost(self.cost)?, one.error());
            (cost.is_finite() && error.is_finite()).then_some((cost, error, ()))
        });
        let front = pareto(places.collect());
        let known = |(cost, error, ()): (f64, f64, ())| (cost, error);
        front.into_iter().map(known).collect()
    }

    /// The cheapest run of another integrator with an error of at most `error`; like [`fastest`](Self::fastest) for
    /// the elements.
    pub fn fastest_peer(&self, error: f64) -> Option<(&Peer, &PeerPoint)> {
        if error < self.reference.uncertainty() {
            return None;
        }
        let points = self.peers.iter().flat_map(|peer| {
            let points = peer.points.iter();
            points.map(move |point| (peer, point))
        });
        let costs = points.filter_map(|(peer, point)| {
            let measured = point.measured().filter(|one| one.error() <= error)?;
            Some((measured.cost(self.cost)?, (peer, point)))
        });
        costs
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, found)| found)
    }

    /// The cost and the error of a point, for the Pareto front.
    pub(super) fn place(&self, point: &Point) -> Option<(f64, f64)> {
        let error = point.error()?;
        let uncertainty = self.reference.uncertainty();
        let error = if error < uncertainty {
            uncertainty
        } else {
            error
        };
        Some((point.cost(self.cost)?, error))
    }
}

/// The entries (cost, error, what) that no other entry dominates, the cheapest first.
pub(crate) fn pareto<T>(mut all: Vec<(f64, f64, T)>) -> Vec<(f64, f64, T)> {
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    all.retain(|(_, error, _)| {
        let is_better = *error < least;
        least = least.min(*error);
        is_better
    });
    all
}

fn cheapest<'p>(
    points: impl Iterator<Item = &'p Point>,
    error: f64,
    uncertainty: f64,
    cost: Cost,
) -> Option<&'p Point> {
    if error < uncertainty {
        return None;
    }
    let costs = points.filter_map(|point| {
        let found = point.error().is_some_and(|one| one <= error);
        Some((point.cost(cost).filter(|_| found)?, point))
    });
    costs
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, point)| point)
}
