//! The cost and the error of one run.

use crate::error::RunErrorKind;
use crate::numbers::larger;
use tfe_runtime::{Element, Solve, Statistics};

/// A measure of the cost of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Cost {
    /// The computing time in seconds.
    #[default]
    Time,
    /// The number of calls of the kernels of first and of second derivatives together.
    Evaluations,
    /// The number of iterations inside elements.
    Iterations,
    /// The number of steps.
    Steps,
}

impl Cost {
    /// The label of an axis.
    #[cfg(feature = "charts")]
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Time => "time of the run (s)",
            Self::Evaluations => "evaluations of derivatives",
            Self::Iterations => "iterations",
            Self::Steps => "steps",
        }
    }
}

/// One run of the comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The element.
    pub element: Element,
    /// How the equations of the element were solved.
    pub solve: Solve,
    /// The step size, in units of time, positive; not more than the span.
    pub step: f64,
    /// The tolerance of the iteration inside elements.
    pub tolerance: f64,
    /// The measurements, or why the run stopped.
    pub outcome: Result<Measured, RunErrorKind>,
}

/// The measurements of a run that reached the end of the span. Errors are relative to the largest |q| and the largest
/// |p| of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Error of the coordinates at the end of the span.
    pub error_q: f64,
    /// Error of the momenta at the end of the span.
    pub error_p: f64,
    /// The largest error of the coordinates at up to ten nodes, equally spaced as far as the steps allow, including
    /// the end.
    pub max_error_q: f64,
    /// The largest error of the momenta at the same nodes.
    pub max_error_p: f64,
    /// The largest change of the energy H = p·v − L at up to about a thousand nodes, relative to the energy at the
    /// start (absolute if that is zero, or no more than a rounding error of p·v), as
    /// [`Motion::energy_error`](crate::Motion::energy_error). For a model that is forced, damped or depends on time it
    /// is a property of the motion and not an error.
    pub energy_error: f64,
    /// The largest violation max |φ| of the holonomic constraints at the same nodes; zero without constraints.
    pub constraint_position: f64,
    /// The largest violation max |A v + a| of all constraints at the same nodes; zero without constraints.
    pub constraint_velocity: f64,
    /// The time of the steps in seconds, the shortest of all repetitions.
    pub seconds: f64,
    /// The number of repetitions.
    pub repetitions: u32,
    /// Counts of steps, iterations, evaluations and factorisations of one run.
    pub statistics: Statistics,
    /// Whether the error at the end is no larger than the uncertainty of the reference, so that the true error may be
    /// smaller or larger.
    pub at_reference_floor: bool,
}

impl Measured {
    /// The larger of the errors of coordinates and momenta at the end.
    pub fn error(&self) -> f64 {
        larger(self.error_q, self.error_p)
    }

    /// The cost in a given measure.
    pub fn cost(&self, cost: Cost) -> f64 {
        let count = match cost {
            Cost::Time => return self.seconds,
            Cost::Evaluations => {
                self.statistics.residual_evaluations + self.statistics.tangent_evaluations
            }
            Cost::Iterations => self.statistics.iterations,
            Cost::Steps => self.statistics.steps,
        };
        count as f64
    }
}

impl Point {
    /// The measurements, if the run reached the end of the span.
    pub fn measured(&self) -> Option<&Measured> {
        self.outcome.as_ref().ok()
    }

    /// The larger of the errors of coordinates and momenta at the end, if the run reached it.
    pub fn error(&self) -> Option<f64> {
        self.measured().map(Measured::error)
    }

    /// What the run cost, if it reached its end.
    pub fn cost(&self, cost: Cost) -> Option<f64> {
        self.measured().map(|measured| measured.cost(cost))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_that_is_no_number_is_not_dropped() {
        let error = |error_q: f64, error_p: f64| {
            let measured = Measured {
                error_q,
                error_p,
                max_error_q: error_q,
                max_error_p: error_p,
                energy_error: 0.0,
                constraint_position: 0.0,
                constraint_velocity: 0.0,
                seconds: 1.0,
                repetitions: 1,
                statistics: Statistics::NONE,
                at_reference_floor: false,
            };
            measured.error()
        };
        assert_eq!([error(1.0, 2.0), error(2.0, 1.0)], [2.0, 2.0]);
        assert!(error(f64::NAN, 1.0).is_nan() && error(1.0, f64::NAN).is_nan());
    }
}
