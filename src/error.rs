//! Errors of runs: what failed, where and why.

use crate::constraints::write_residuals;
use crate::driven::InputError;
use crate::length::{FixedLength, Length};
use crate::motion::Motion;
use crate::numbers::{Short, WrongTolerance};
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

impl fmt::Display for RunErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Element(error) => error.fmt(f),
            Self::Family(error) => error.fmt(f),
            Self::Step { step } if step.is_nan() => f.write_str(
                "the step size is not a number; runs without an end (`steps`, `hold`, `section`) have no default: set it with `step(h)`",
            ),
            Self::Step { step } => {
                let step = Short(*step);
                write!(f, "the step is {step}, but it must be finite and not zero")
            }
            Self::Accuracy { asked } => {
                let asked = Short(*asked);
                write!(
                    f,
                    "the accuracy is {asked}, but it must lie between 0 and 1"
                )
            }
            Self::Tolerance { tolerance } => write!(f, "{}", WrongTolerance(*tolerance)),
            Self::AccuracyMissed {
                asked,
                estimate,
                until,
            } => {
                write!(
                    f,
                    "the error is estimated at {estimate:.1e}, above the {asked:.1e} asked for"
                )?;
                if let Some(time) = until {
                    write!(f, "; it is met up to t = {}", Short(*time))?;
                }
                f.write_str("; allow a larger error, or a shorter span")
            }
            Self::Span { start, end } => {
                let (start, end) = (Short(*start), Short(*end));
                write!(f, "the span {start}..{end} has an end or a length that is not finite: give finite times; `steps` needs no end")
            }
            Self::TooManySteps { span, step } => {
                let (span, step) = (Short(*span), Short(*step));
                write!(
                    f,
                    "a span of {span} holds too many steps of {step}: choose longer steps, a shorter span, or a larger error if an accuracy was asked for"
                )
            }
            Self::StepUnresolved { time, step, least } => {
                let (step, time) = (Short(*step), Short(*time));
                write!(
                    f,
                    "a step of {step} is not resolved at t = {time}, where the shortest possible step is {least:.1e}: measure the time from an origin near the motion"
                )
            }
            Self::NoOutput { name, known } => {
                let known = listed(known);
                write!(f, "there is no output `{name}`: the model declares {known}")
            }
            Self::Loss { name, why } => {
                write!(f, "the loss cannot be used, because of `{name}`: {why}")
            }
            Self::NoEvent { name, known } if known.is_empty() => {
                write!(
                    f,
                    "there is no event or output `{name}`: the model declares none; add `event({name}) = …` to its `#[dynamics(...)]`"
                )
            }
            Self::NoEvent { name, known } => {
                write!(
                    f,
                    "there is no event or output `{name}`: the model declares {}",
                    known.join(", ")
                )
            }
            Self::EventsWithoutEnd { name, time } => {
                let time = Short(*time);
                write!(
                    f,
                    "the event `{name}` repeats ever sooner and without end at t = {time}, because the motion comes to rest there: end the run with `Act::Stop`, or leave the motion unchanged with `Act::Record`"
                )
            }
            Self::NoCrossing { name, from, time } => {
                let (from, time) = (Short(*from), Short(*time));
                write!(
                    f,
                    "the motion does not cross the section `{name}` from t = {from} to t = {time}: look at the surface and at the direction of the crossing, or search longer with `within(elements)`"
                )
            }
            Self::NoParameter { name, known } => {
                let known = listed(known);
                write!(
                    f,
                    "there is no parameter `{name}`: the model has {known}"
                )
            }
            Self::Parameter { name, value } => {
                write!(
                    f,
                    "parameter `{name}` was set to {value}, which is not finite",
                    value = Short(*value)
                )
            }
            Self::ParametersFixed => write!(
                f,
                "the parameters of this model cannot be changed: it has a field that cannot be copied, or kernels written by hand that do not implement `with_parameter`"
            ),
            Self::SetUnsupported { call } => write!(
                f,
                "`{call}` cannot differentiate a run whose events set parameters: use `run`, or `run_linearised` if the values do not depend on the state"
            ),
            Self::SetByState {
                event,
                time,
                parameter,
            } => write!(
                f,
                "the event `{event}` at t = {} sets `{parameter}` to a value that depends on the state, which transition matrices do not include: use differences of `run`, or replace the parameter by a coordinate whose momentum does not appear in the Hamiltonian",
                Short(*time)
            ),
            Self::Input(error) => error.fmt(f),
            Self::Ended { time } => {
                let time = Short(*time);
                write!(f, "a step after t = {time} failed: the run has ended; begin another one from the last node")
            }
            Self::NodeOrder { node, time } => {
                let time = Short(*time);
                write!(
                    f,
                    "node {node} at t = {time} does not lie beyond the one before it, in the direction of the run: the times of nodes must be finite and in order"
                )
            }
            Self::NodeEnds {
                first: Some(first),
                last: Some(last),
                start,
                end,
            } => {
                let [first, last, start, end] = [first, last, start, end].map(|time| Short(*time));
                write!(
                    f,
                    "the nodes go from {first} to {last}, but the span is {start}..{end}: its ends must be the first and the last node"
                )
            }
            Self::NodeEnds { start, end, .. } => {
                let (start, end) = (Short(*start), Short(*end));
                write!(f, "there are no nodes in the span {start}..{end}: give at least its two ends")
            }
            Self::Break => f.write_str(
                "the time of a break is not a number: give `break_at` the time at which a force jumps, or leave it out",
            ),
            Self::Start { coordinate, q, p } => {
                let (q, p) = (Short(*q), Short(*p));
                write!(
                    f,
                    "the start is not finite: coordinate {coordinate} is {q}, its momentum {p}"
                )
            }
            Self::Inconsistent { time, residuals } => {
                let time = Short(*time);
                write!(f, "the start at t = {time} violates constraints:")?;
                write_residuals(f, residuals)?;
                write!(
                    f,
                    "; `consistent_state` finds the nearest start that satisfies them"
                )
            }
            Self::Unsupported { call, of } => write!(f, "`{call}` is not supported for {of}"),
            Self::Impulse { time } => {
                let time = Short(*time);
                write!(
                    f,
                    "the impulse at t = {time} is not finite or lies outside the span: move it into the span, or leave it out"
                )
            }
            Self::Solve {
                element,
                time,
                step,
                source,
            } => {
                let (time, step) = (Short(*time), Short(*step));
                write!(f, "element {element} (t = {time}, h = {step}): {source}")
            }
            Self::Transition {
                element,
                time,
                step,
                source,
            } => {
                let (time, step) = (Short(*time), Short(*step));
                write!(
                    f,
                    "element {element} (t = {time}, h = {step}) has no transition matrix: {source}"
                )
            }
        }
    }
}

/// Names that are known, in a message.
fn listed(known: &[String]) -> String {
    match known.is_empty() {
        true => "none".to_owned(),
        false => known.join(", "),
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
