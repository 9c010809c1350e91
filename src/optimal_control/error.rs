//! Why there is no optimum.

use super::optimum::Optimum;
use crate::boundary::BoundaryError;
use crate::driven::InputError;
use std::error::Error;
use std::fmt;
use tfe_runtime::{ElementError, LegendreError};

/// Why no inputs of least cost were found, and where the search has ended.
#[derive(Clone)]
pub struct OptimalControlError<const N: usize> {
    kind: OptimalControlErrorKind,
    partial: Option<Box<Optimum<N>>>,
}

impl<const N: usize> fmt::Debug for OptimalControlError<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind.fmt(f)
    }
}

impl<const N: usize> OptimalControlError<N> {
    pub(super) fn with(kind: OptimalControlErrorKind, partial: Optimum<N>) -> Self {
        Self {
            kind,
            partial: Some(Box::new(partial)),
        }
    }

    /// What went wrong.
    pub fn kind(&self) -> &OptimalControlErrorKind {
        &self.kind
    }

    /// Where the search has ended, with its history; `None` where it did not begin. What it holds is no motion as long as its elements have gaps.
    pub fn partial(&self) -> Option<&Optimum<N>> {
        self.partial.as_deref()
    }
}

/// What went wrong.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum OptimalControlErrorKind {
    /// The span, the mesh or what is given at the ends makes no sense.
    Ends(BoundaryError),
    /// The span goes backwards: integrals of costs would be negative.
    Backwards,
    /// The element does not exist.
    Element(ElementError),
    /// The model has constraints, with which this cannot be done.
    Constrained {
        /// The first of them.
        constraint: &'static str,
    },
    /// Nothing costs anything.
    NoCost,
    /// A cost is no output of the model.
    UnknownOutput {
        /// The name asked for.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// A cost of the end holds an input, which has no value there of its own.
    EndCostOfInput {
        /// The output.
        output: String,
        /// The input.
        input: &'static str,
    },
    /// A guess is for an input that the model does not have.
    Input(InputError),
    /// The inputs have a higher degree than the points of an element tell.
    Degree {
        /// The degree asked for.
        degree: usize,
        /// The largest there is.
        largest: usize,
    },
    /// A momentum of the guess could not be found.
    Legendre(LegendreError),
    /// An element has no linearisation: a number is not finite, or its equations are singular.
    Undefined {
        /// The number of the element, from 0; as many as there are elements for the cost of the end.
        element: usize,
        /// Its start time.
        time: f64,
        /// Iterations done.
        iterations: usize,
    },
    /// No quadratic model of the problem has one minimum: an input costs nothing and moves nothing, the cost curves down along what is free of the start by more than inputs cost, or small changes of the
    /// inputs do not bring the motion to its ends.
    Singular {
        /// Iterations done.
        iterations: usize,
    },
    /// The search came to no end.
    Stalled {
        /// Iterations done.
        iterations: usize,
        /// The size of the last correction beside the solution.
        correction: f64,
        /// What was asked for.
        tolerance: f64,
    },
    /// The search came to a point where small changes of the inputs, and of what is free of the start, do not change the cost to first order but lower it to second: a saddle or a maximum, as a pendulum
    /// that hangs at rest where that costs most. No minimum was found on from there; or the cost falls without end.
    NoMinimum {
        /// The number of the element in which the changes begin that lower the cost, from 0.
        element: usize,
        /// Its start time.
        time: f64,
        /// Iterations done.
        iterations: usize,
    },
}

impl<const N: usize> From<OptimalControlErrorKind> for OptimalControlError<N> {
    fn from(kind: OptimalControlErrorKind) -> Self {
        Self {
            kind,
            partial: None,
        }
    }
}

impl<const N: usize> From<BoundaryError> for OptimalControlError<N> {
    fn from(error: BoundaryError) -> Self {
        OptimalControlErrorKind::Ends(error).into()
    }
}

impl<const N: usize> From<ElementError> for OptimalControlError<N> {
    fn from(error: ElementError) -> Self {
        OptimalControlErrorKind::Element(error).into()
    }
}

impl From<BoundaryError> for OptimalControlErrorKind {
    fn from(error: BoundaryError) -> Self {
        Self::Ends(error)
    }
}

impl From<InputError> for OptimalControlErrorKind {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<LegendreError> for OptimalControlErrorKind {
    fn from(error: LegendreError) -> Self {
        Self::Legendre(error)
    }
}

impl<const N: usize> fmt::Display for OptimalControlError<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind.fmt(f)
    }
}

impl fmt::Display for OptimalControlErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ends(error) => error.fmt(f),
            Self::Backwards => {
                f.write_str("the span goes backwards: costs are counted forwards in time")
            }
            Self::Element(error) => error.fmt(f),
            Self::Constrained { constraint } => write!(
                f,
                "the model has the constraint `{constraint}`: optimal control needs coordinates without constraints"
            ),
            Self::NoCost => f.write_str(
                "nothing costs anything: name an output with `.running_cost(…)` or `.end_cost(…)`",
            ),
            Self::UnknownOutput { name, known } if known.is_empty() => {
                write!(f, "the model has no output `{name}`: it declares none")
            }
            Self::UnknownOutput { name, known } => write!(
                f,
                "the model has no output `{name}`, only `{}`",
                known.join("`, `")
            ),
            Self::EndCostOfInput { output, input } => write!(
                f,
                "the cost `{output}` of the end holds the input `{input}`, which has no value there of its own: make it a running cost"
            ),
            Self::Input(error) => error.fmt(f),
            Self::Degree { degree, largest } => write!(
                f,
                "inputs of degree {degree}, but the points of the element tell {largest} at most"
            ),
            Self::Legendre(error) => error.fmt(f),
            Self::Undefined {
                element,
                time,
                iterations,
            } => write!(
                f,
                "element {element}, at t = {time}, is singular or not finite after {iterations} iterations: another guess may help"
            ),
            Self::Singular { iterations } => {
                f.write_str("the problem has no single minimum near ")?;
                match iterations {
                    0 => f.write_str("the guess")?,
                    _ => write!(f, "what {iterations} iterations have found")?,
                }
                f.write_str(
                    ": an input costs nothing and moves nothing, the cost curves down along what is free of the start, \
                     or small changes of the inputs do not bring the motion to its ends; \
                     another guess or another span may help",
                )
            }
            Self::Stalled {
                iterations,
                correction,
                tolerance,
            } => write!(
                f,
                "no minimum after {iterations} iterations: the last correction is {correction:.1e} of the solution, {tolerance:.1e} was asked for; \
                 a better guess or more elements may help, or the cost falls without end"
            ),
            Self::NoMinimum {
                element,
                time,
                iterations,
            } => write!(
                f,
                "no minimum after {iterations} iterations, but a stationary point from which the cost falls along small changes that begin in element {element}, at t = {time}; \
                 begin with another guess of the inputs (`.guess_input(…)`) or of the motion (`.guess(…)`), or see whether the cost falls without end"
            ),
        }
    }
}

impl<const N: usize> Error for OptimalControlError<N> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.kind.source()
    }
}

impl Error for OptimalControlErrorKind {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Ends(error) => Some(error),
            Self::Element(error) => Some(error),
            Self::Input(error) => Some(error),
            Self::Legendre(error) => Some(error),
            _ => None,
        }
    }
}
