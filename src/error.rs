//! Errors of runs: what failed, where and why.

mod wording;

use crate::driven::InputError;
use crate::length::{FixedLength, Length};
use crate::motion::Motion;
use crate::numbers::Short;
use std::error::Error;
use std::fmt;
use tfe_runtime::constrained::Residual;
use tfe_runtime::family;
use tfe_runtime::transition::TransitionError;
use tfe_runtime::{ElementError, InputFailure, StepError};

pub use crate::motion::AtError;

/// Why a run failed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum RunErrorKind {
    /// The element does not exist: an impossible number of nodes, or a quadrature that this family of elements does
    /// not have.
    Element(ElementError),
    /// The model does not pass its [check](crate::Model::check): an index computed from its fields is outside its
    /// array, or lengths do not fit each other. For models of run-time length also something that such models do not
    /// support.
    Family(family::ModelError),
    /// The step size is zero, infinite or not a number. It is not a number (NaN) if a run without an end was given no
    /// step size.
    Step {
        /// The step asked for.
        step: f64,
    },
    /// The accuracy asked for is not between 0 and 1.
    Accuracy {
        /// The value asked for.
        asked: f64,
    },
    /// The tolerance of the iteration inside an element is not a number from 0 to below 1.
    Tolerance {
        /// The tolerance asked for.
        tolerance: f64,
    },
    /// No step size was found with which the estimated error is as small as asked. The motion in
    /// [`partial`](RunError::partial) is the best one found.
    AccuracyMissed {
        /// The value asked for.
        asked: f64,
        /// The estimated error of the motion, measured as
        /// [`Estimated::error_estimate`](crate::accuracy::Estimated::error_estimate) says, but not less than the
        /// rounding unit.
        estimate: f64,
        /// The last time up to which the estimate is as small as asked; `None` if it is larger from the first
        /// comparison on.
        until: Option<f64>,
    },
    /// An output of the model is not finite in a run with an accuracy, so that its error cannot be estimated with any
    /// step size.
    OutputNotFinite {
        /// The output.
        output: String,
        /// The first time at which it was found not to be finite, in the last run of the search.
        time: f64,
    },
    /// A loss names an output that the model does not declare.
    NoOutput {
        /// The name asked for.
        name: String,
        /// The outputs that the model declares.
        known: Vec<String>,
    },
    /// The values or derivatives of a loss cannot be used.
    Loss {
        /// An output, the parameter by which it is differentiated, or `start`.
        name: String,
        /// The reason.
        why: &'static str,
    },
    /// The ends of the span, or its length, are not finite.
    Span {
        /// The start asked for.
        start: f64,
        /// The end asked for.
        end: f64,
    },
    /// The span holds more steps than can be counted, or an accuracy would take more than ten million steps.
    TooManySteps {
        /// Length of the span.
        span: f64,
        /// The step asked for.
        step: f64,
    },
    /// The step is so short compared with the time itself that successive nodes would have the same time, because a
    /// time has 53 bits. Measure the time from an origin near the motion.
    StepUnresolved {
        /// The largest time of the span.
        time: f64,
        /// The step asked for.
        step: f64,
        /// The shortest step that can be resolved at that time.
        least: f64,
    },
    /// The time of a node is not finite, or does not lie beyond that of the node before, in the direction of the run.
    NodeOrder {
        /// The index of the node, from 0.
        node: usize,
        /// Its time.
        time: f64,
    },
    /// The first and the last node are not the ends of the span.
    NodeEnds {
        /// The first node; `None` where there are none.
        first: Option<f64>,
        /// The last node.
        last: Option<f64>,
        /// The start of the span.
        start: f64,
        /// Its end.
        end: f64,
    },
    /// The time of a [break](crate::Simulation::break_at) is not a number.
    Break,
    /// A coordinate or momentum of the start is not finite.
    Start {
        /// The index of the coordinate.
        coordinate: usize,
        /// Its value.
        q: f64,
        /// Its momentum.
        p: f64,
    },
    /// The start violates the constraints. [`ConsistentState`](crate::ConsistentState) finds consistent initial
    /// conditions.
    Inconsistent {
        /// The time of the start.
        time: f64,
        /// The violation of each constraint.
        residuals: Vec<Residual>,
    },
    /// An impulse acts at a time outside the span, or its time or a component is not finite.
    Impulse {
        /// The time at which it was to act.
        time: f64,
    },
    /// The call is not supported for this kind of model (see `docs/calls.md`).
    Unsupported {
        /// The call.
        call: &'static str,
        /// The kind of models.
        of: &'static str,
    },
    /// The model declares no event or output of this name.
    NoEvent {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// Infinitely many events follow each other in a finite time, because the motion comes to rest on the surface of
    /// the event: an event happened twice within a millionth of a step, or events a thousand times within a thousandth
    /// of a step, or forces press the motion through the surface on which an
    /// [impact](crate::Occurrence::after_impact) has stopped it.
    EventsWithoutEnd {
        /// The event.
        name: String,
        /// The time at which the run stopped.
        time: f64,
    },
    /// A [section](crate::Simulation::section) was not crossed within as many elements as a search may take.
    NoCrossing {
        /// The event.
        name: String,
        /// The time of the last crossing, or of the start.
        from: f64,
        /// The time up to which was searched.
        time: f64,
    },
    /// A parameter that was to be set, or by which to differentiate, does not exist in the model.
    NoParameter {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// A parameter was set to a number that is not finite.
    Parameter {
        /// Its name.
        name: String,
        /// The value.
        value: f64,
    },
    /// Parameters were to be changed of a model that cannot be copied with other parameters: its kernels are written
    /// by hand and do not say how, or it has a field that cannot be copied.
    ParametersFixed,
    /// An event set parameters in a run with derivatives with respect to parameters, which cannot know how the new
    /// values depend on the old ones.
    SetUnsupported {
        /// The call.
        call: &'static str,
    },
    /// An event set a parameter to a value that depends on the state at the event, or on a time of the event that
    /// depends on the state, in a run with transition matrices. These hold derivatives with respect to the state only,
    /// and after the event the motion depends on the parameter, too. Use a coordinate in place of the parameter: one
    /// whose momentum does not appear in the Hamiltonian is constant until [`Act::Restart`](crate::Act::Restart)
    /// changes it, and is differentiated as every coordinate is.
    SetByState {
        /// The event.
        event: String,
        /// The time of the event.
        time: f64,
        /// The parameter that it set.
        parameter: String,
    },
    /// The model does not have this input, or its values cannot be used.
    Input(InputError),
    /// An earlier step failed, so that the run cannot continue.
    Ended {
        /// The time of the last node.
        time: f64,
    },
    /// The equations of an element could not be solved.
    Solve {
        /// The number of the element, from 0.
        element: usize,
        /// Its start time.
        time: f64,
        /// Its length.
        step: f64,
        /// The cause.
        source: StepError,
    },
    /// An element was solved, but has no transition matrix (no derivative).
    Transition {
        /// The number of the element, from 0.
        element: usize,
        /// Its start time.
        time: f64,
        /// Its length.
        step: f64,
        /// The cause.
        source: TransitionError,
    },
}

impl RunErrorKind {
    /// The error of an element that could not be solved; if the function of an input was not finite in it, the error
    /// names that.
    pub(crate) fn of_element(
        failed_input: Option<InputFailure>,
        element: usize,
        (time, step): (f64, f64),
        source: StepError,
    ) -> Self {
        let end = time + step;
        let slack = 1e-6 * step.abs();
        let is_within = |failure: &InputFailure| {
            time.min(end) - slack <= failure.time && failure.time <= time.max(end) + slack
        };
        match failed_input.filter(is_within) {
            Some(InputFailure { input, time, value }) => Self::Input(InputError::Value {
                name: input.to_owned(),
                time,
                value,
            }),
            None => Self::Solve {
                element,
                time,
                step,
                source,
            },
        }
    }

    /// The error of a stepper of a model of fixed size that could not be made.
    pub(crate) fn of_stepper(error: family::ModelError) -> Self {
        match error {
            family::ModelError::Element(error) => Self::Element(error),
            error => Self::Family(error),
        }
    }

    /// The error of an input function that panicked in an element.
    pub(crate) fn panicked(time: f64) -> Self {
        Self::Input(InputError::Panicked { time })
    }
}

/// A run that stopped before its end: why, and the motion up to the last good state.
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x), momenta(p), hamiltonian = p^2/2 + 2*sqrt(x))]
/// struct Fall;
///
/// // From rest at x = 1 to x = 0 at t = 4/3, where the square root ends.
/// let start = State { q: [1.0], p: [0.0] };
/// let run = Simulation::new(&Fall).element(Mixed::<3>).step(0.01).run(start, 0.0..3.0);
/// let error = run.expect_err("there is nothing beyond zero");
/// assert!((error.partial().last().t - 4.0 / 3.0).abs() < 0.04);
/// println!("{error}"); // where, why, what to do
/// ```
#[derive(Clone, Debug)]
pub struct RunError<const N: usize, L: Length<N> = FixedLength> {
    kind: RunErrorKind,
    partial: Box<Motion<N, L>>,
}

impl<const N: usize, L: Length<N>> RunError<N, L> {
    pub(crate) fn new(kind: RunErrorKind, partial: Motion<N, L>) -> Self {
        Self {
            kind,
            partial: Box::new(partial),
        }
    }

    /// The result of a run: its motion, or why it failed, with the motion up to there.
    pub(crate) fn unless_whole(
        motion: Motion<N, L>,
        failure: Option<RunErrorKind>,
    ) -> Result<Motion<N, L>, Self> {
        match failure {
            None => Ok(motion),
            Some(kind) => Err(Self::new(kind, motion)),
        }
    }

    /// The same error for a call that was made by another one; that one is named.
    pub(crate) fn of_call(mut self, made: &str, by: &'static str) -> Self {
        if let RunErrorKind::SetUnsupported { call } | RunErrorKind::Unsupported { call, .. } =
            &mut self.kind
            && *call == made
        {
            *call = by;
        }
        self
    }

    /// Why the run stopped.
    pub fn kind(&self) -> &RunErrorKind {
        &self.kind
    }

    /// The motion up to the last good state; the start alone where the run never began.
    pub fn partial(&self) -> &Motion<N, L> {
        &self.partial
    }

    /// The motion up to the last good state, by value.
    pub fn into_partial(self) -> Motion<N, L> {
        *self.partial
    }
}

impl Error for RunErrorKind {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Element(error) => Some(error),
            Self::Family(error) => Some(error),
            Self::Input(error) => Some(error),
            Self::Solve { source, .. } => Some(source),
            Self::Transition { source, .. } => Some(source),
            _ => None,
        }
    }
}

impl<const N: usize, L: Length<N>> fmt::Display for RunError<N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind.fmt(f)?;
        match self.partial.states().last() {
            Some(node) if self.partial.states().len() > 1 => {
                write!(
                    f,
                    "; the motion up to t = {} is in `partial()`",
                    Short(node.t)
                )?;
            }
            _ => {}
        }
        // The likely causes of the failure.
        for warning in self.partial.warnings() {
            write!(f, "; {warning}")?;
        }
        Ok(())
    }
}

impl<const N: usize, L: Length<N>> Error for RunError<N, L> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.kind.source()
    }
}
