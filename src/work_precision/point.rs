//! One run: what it cost, and how far off it was.

use crate::error::RunErrorKind;
use crate::numbers::larger;
use tfe_runtime::{Element, Solve, Statistics};

/// What a run is charged with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Cost {
    /// Seconds.
    #[default]
    Time,
    /// Calls of the kernels of first and of second derivatives together.
    Evaluations,
    /// Iterations inside the elements.
    Iterations,
    /// Steps.
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
    /// How its equations were solved.
    pub solve: Solve,
    /// The step, in the units of time, positive; the span where a longer one was asked for.
    pub step: f64,
    /// The tolerance of its iteration.
    pub tolerance: f64,
    /// What was measured, or why the run stopped.
    pub outcome: Result<Measured, RunErrorKind>,
}

/// What was measured of a run that reached its end. Errors are relative to the largest |q| and the largest |p| of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Error of the coordinates at the end of the span.
    pub error_q: f64,
    /// Error of the momenta at the end of the span.
    pub error_p: f64,
    /// The largest error of the coordinates at up to ten nodes, equally spaced as far as the step allows, the end included.
    pub max_error_q: f64,
    /// The same of the momenta.
    pub max_error_p: f64,
    /// The largest change of the energy H = p·v − L, relative to that at the start (absolute where that is zero, or not more than a rounding beside p·v), at no
    /// more than about a thousand nodes, as [`Motion::energy_error`](crate::Motion::energy_error) tells it. Of a model that is forced, damped or depends on time it measures physics, not error.
    pub energy_error: f64,
    /// max |φ| of the holonomic constraints at the same nodes; zero without any.
    pub constraint_position: f64,
    /// max |A v + a| of all constraints at the same nodes; zero without any.
    pub constraint_velocity: f64,
    /// Seconds that the steps took, the least of all repetitions.
    pub seconds: f64,
    /// How often the run was repeated for that.
    pub repetitions: u32,
    /// Steps, iterations, evaluations, factorisations of one run.
    pub statistics: Statistics,
    /// Whether the error at the end is no larger than the uncertainty of the reference: the run may be better than it looks, or worse.
    pub at_reference_floor: bool,
}

impl Measured {
    /// The larger of the errors of coordinates and momenta at the end.
    pub fn error(&self) -> f64 {
        larger(self.error_q, self.error_p)
    }

    /// What it cost.
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
    /// What was measured, if the run reached its end.
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
