//! Why an assembled problem has no solution.

use crate::numbers::{Short, WrongTolerance};
use std::fmt;
use tfe_runtime::{ElementError, LegendreError, ModelError, StepError};

/// Why the assembled equations of a boundary-value problem, periodic orbit or similar have no solution.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum AssemblyError {
    /// The model does not pass its [check](crate::Model::check).
    Model(ModelError),
    /// The element does not exist: an impossible number of nodes, or a quadrature that its family does not have.
    Element(ElementError),
    /// The tolerance is not a number from 0 to below 1.
    Tolerance {
        /// The tolerance given.
        tolerance: f64,
    },
    /// The equations of an element could not be linearised.
    Linearise {
        /// The number of the element, from 0.
        element: usize,
        /// Its start time.
        time: f64,
        /// The cause.
        source: StepError,
    },
    /// A velocity or a momentum at a node could not be found (Legendre transform).
    Legendre(LegendreError),
    /// The solution violates a constraint at a node. Elements keep only as many constraints as are independent, so
    /// this happens if constraints contradict each other, if the position is singular, or if the coordinates asked for
    /// at the ends violate the constraints.
    Violated {
        /// The name of the constraint.
        constraint: &'static str,
        /// The time of the node.
        time: f64,
        /// Whether the positions violate it; otherwise the velocities do.
        position: bool,
        /// The relative violation, the first of these that exceeds the limit: |φ| / |φ_q| relative to the largest |q|
        /// of the solution, |A v + a| / |A| relative to the largest |v|, and |φ| and |A v + a| relative to their own
        /// terms.
        residual: f64,
    },
    /// The assembled equations are singular: there is no solution, or there are many close to each other (for example
    /// a family of periodic orbits, or ends that are conjugate points).
    Singular {
        /// Corrections made before the equations were found to be singular.
        iterations: u32,
    },
    /// Newton's method did not converge.
    Stalled {
        /// Iterations done.
        iterations: u32,
        /// The size of the last correction, relative to the solution.
        correction: f64,
        /// The tolerance: the relative correction at which the iteration ends.
        tolerance: f64,
    },
}

impl fmt::Display for AssemblyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Model(error) => error.fmt(f),
            Self::Element(error) => error.fmt(f),
            Self::Tolerance { tolerance } => write!(f, "{}", WrongTolerance(*tolerance)),
            Self::Linearise {
                element,
                time,
                source,
            } => write!(f, "element {element}, at t = {}: {source}", Short(*time)),
            Self::Legendre(error) => error.fmt(f),
            Self::Violated {
                constraint,
                time,
                position,
                residual,
            } => write!(
                f,
                "the solution violates the constraint `{constraint}` at t = {}: {} off by {residual:.1e} of the largest; dependent constraints contradict each other, \
                 the position is singular, or the values given at the ends violate the constraints",
                Short(*time),
                if *position { "position" } else { "velocity" }
            ),
            Self::Singular { iterations } => write!(
                f,
                "the assembled equations are singular {}: there is no solution near the guess, or a whole family of them; another guess, or another span or period, may help",
                match iterations {
                    0 => "at the guess".to_owned(),
                    1 => "after one iteration".to_owned(),
                    _ => format!("after {iterations} iterations"),
                }
            ),
            Self::Stalled {
                iterations,
                correction,
                tolerance,
            } => write!(
                f,
                "no solution after {iterations} iterations: the last correction is {correction:.1e} of the solution, {tolerance:.1e} was asked for; \
                 a better guess or more elements may help"
            ),
        }
    }
}

impl std::error::Error for AssemblyError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Model(error) => Some(error),
            Self::Element(error) => Some(error),
            Self::Linearise { source, .. } => Some(source),
            Self::Legendre(error) => Some(error),
            _ => None,
        }
    }
}

impl From<ElementError> for AssemblyError {
    fn from(error: ElementError) -> Self {
        Self::Element(error)
    }
}

impl From<LegendreError> for AssemblyError {
    fn from(error: LegendreError) -> Self {
        Self::Legendre(error)
    }
}
