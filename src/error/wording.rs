//! The messages of errors of runs.

use super::RunErrorKind;
use crate::constraints::write_residuals;
use crate::numbers::{Short, WrongTolerance};
use std::fmt;

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
            Self::OutputNotFinite { output, time } => {
                let time = Short(*time);
                write!(
                    f,
                    "the output `{output}` is not finite at t = {time}, so that no step has an error that can be estimated: look for a division by zero, a root or a logarithm of a negative number, or leave the output out of the model"
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
