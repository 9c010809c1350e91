//! The errors of optimal control.

use super::optimum::Optimum;
use crate::boundary::BoundaryError;
use crate::driven::InputError;
use crate::numbers::{Short, WrongTolerance};
use std::error::Error;
use std::fmt;
use tfe_runtime::{ElementError, LegendreError, ModelError};

/// Why no inputs of least cost were found, and the iterate at which the search ended.
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

    /// The kind of the error.
    pub fn kind(&self) -> &OptimalControlErrorKind {
        &self.kind
    }

    /// The iterate at which the search ended, with its history; `None` if the search did not begin. It is not a motion
    /// of the model as long as there are gaps between its elements.
    pub fn partial(&self) -> Option<&Optimum<N>> {
        self.partial.as_deref()
    }
}

/// Why an optimal-control problem was not solved.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum OptimalControlErrorKind {
    /// The span, the mesh, or the values given at the ends are invalid.
    Ends(BoundaryError),
    /// The span goes backwards in time, so that integrals of costs would have the opposite sign.
    Backwards,
    /// The model does not pass its [check](crate::Model::check).
    Model(ModelError),
    /// The element does not exist.
    Element(ElementError),
    /// The model has constraints, which are not supported here.
    Constrained {
        /// The first of them.
        constraint: &'static str,
    },
    /// No cost was given.
    NoCost,
    /// A cost is not an output that the model declares.
    UnknownOutput {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// An end cost depends on an input, which has no value of its own at the end.
    EndCostOfInput {
        /// The output.
        output: String,
        /// The input.
        input: &'static str,
    },
    /// A guess was given for an input that the model does not have.
    Input(InputError),
    /// The degree of the inputs is higher than the points of an element can determine.
    Degree {
        /// The degree asked for.
        degree: usize,
        /// The largest possible degree.
        largest: usize,
    },
    /// The tolerance is not a number from 0 to below 1.
    Tolerance {
        /// The tolerance given.
        tolerance: f64,
    },
    /// A momentum of the guess could not be found (Legendre transform).
    Legendre(LegendreError),
    /// An element could not be linearised: a number is not finite, or its equations are singular.
    Undefined {
        /// The number of the element, from 0; as many as there are elements for the cost of the end.
        element: usize,
        /// Its start time.
        time: f64,
        /// Iterations done.
        iterations: usize,
    },
    /// No quadratic model of the problem has a unique minimum: an input has neither a cost nor an effect, the negative
    /// curvature of the cost along the free part of the start exceeds the cost of inputs, or small changes of the
    /// inputs cannot bring the motion to the values given at its ends (the problem is not controllable).
    Singular {
        /// Iterations done.
        iterations: usize,
    },
    /// The iteration did not converge.
    Stalled {
        /// Iterations done.
        iterations: usize,
        /// The size of the last correction, relative to the solution.
        correction: f64,
        /// The tolerance: the relative correction at which the iteration ends.
        tolerance: f64,
    },
    /// The search reached a stationary point that is not a minimum: small changes of the inputs, and of the free part
    /// of the start, change the cost in second order only, but lower it. It is a saddle point or a maximum, such as a
    /// pendulum that hangs at rest where that costs most. No minimum was found from there, or the cost decreases
    /// without bound.
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
                f.write_str("the span goes backwards: costs are counted forwards in time, so that it must end after its start")
            }
            Self::Model(error) => error.fmt(f),
            Self::Element(error) => error.fmt(f),
            Self::Constrained { constraint } => write!(
                f,
                "the model has the constraint `{constraint}`: optimal control needs coordinates without constraints"
            ),
            Self::NoCost => f.write_str(
                "no cost was given: name an output with `.running_cost(…)` or `.end_cost(…)`",
            ),
            Self::UnknownOutput { name, known } if known.is_empty() => {
                write!(f, "the model has no output `{name}`: it declares none; add `output({name}) = …` to its `#[dynamics(...)]`")
            }
            Self::UnknownOutput { name, known } => write!(
                f,
                "the model has no output `{name}`, only `{}`",
                known.join("`, `")
            ),
            Self::EndCostOfInput { output, input } => write!(
                f,
                "the end cost `{output}` depends on the input `{input}`, which has no value of its own at the end: make it a running cost"
            ),
            Self::Input(error) => error.fmt(f),
            Self::Degree { degree, largest } => write!(
                f,
                "inputs of degree {degree} were asked for, but the points of the element determine degree {largest} at most"
            ),
            Self::Tolerance { tolerance } => write!(f, "{}", WrongTolerance(*tolerance)),
            Self::Legendre(error) => error.fmt(f),
            Self::Undefined {
                element,
                time,
                iterations,
            } => write!(
                f,
                "element {element}, at t = {time}, is singular or not finite after {iterations} iterations: another guess may help",
                time = Short(*time)
            ),
            Self::Singular { iterations } => {
                f.write_str("the problem has no single minimum near ")?;
                match iterations {
                    0 => f.write_str("the guess")?,
                    _ => write!(f, "what {iterations} iterations have found")?,
                }
                f.write_str(
                    ": an input has neither a cost nor an effect, the cost has negative curvature along the free part of the start, \
                     or small changes of the inputs cannot bring the motion to the values given at its ends; \
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
                 a better guess or more elements may help, or the cost decreases without bound"
            ),
            Self::NoMinimum {
                element,
                time,
                iterations,
            } => write!(
                f,
                "no minimum after {iterations} iterations, but a stationary point from which the cost falls along small changes that begin in element {element}, at t = {time}; \
                 begin with another guess of the inputs (`.guess_input(…)`) or of the motion (`.guess(…)`), or check whether the cost decreases without bound",
                time = Short(*time)
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
            Self::Model(error) => Some(error),
            Self::Element(error) => Some(error),
            Self::Input(error) => Some(error),
            Self::Legendre(error) => Some(error),
            _ => None,
        }
    }
}
