//! Why a step failed.

use core::fmt;

/// Why the pointwise change between velocity and momentum failed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LegendreError {
    /// ∂²L/∂v² (or ∂²H/∂p²) is singular: no velocity (momentum) belongs to the other, or many.
    Singular {
        /// The coordinate at which elimination stopped.
        coordinate: usize,
    },
    /// Newton's iteration came to no end.
    Stalled {
        /// Iterations done.
        iterations: u32,
        /// The largest component that is left of p − L_v (or v − H_p).
        residual: f64,
    },
    /// The model gave a value that is not a number, or the state is none.
    NonFinite,
}

impl fmt::Display for LegendreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Singular { coordinate } => write!(
                f,
                "the second derivative by velocities (momenta) is singular at coordinate \
                 {coordinate}"
            ),
            Self::Stalled {
                iterations,
                residual,
            } => write!(
                f,
                "the velocity (momentum) was not found in {iterations} iterations, residual \
                 {residual:.1e}"
            ),
            Self::NonFinite => f.write_str("the model gave a value that is not finite"),
        }
    }
}

impl core::error::Error for LegendreError {}

/// Why a step failed. Where it failed is known to whoever counts the steps.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// The length of a step is zero or not finite.
    InvalidStep {
        /// Length of the element.
        step: f64,
    },
    /// The caller's memory is too small for the element.
    Workspace {
        /// Numbers that are needed.
        needed: usize,
        /// Numbers that were given.
        given: usize,
    },
    /// A value that is not finite turned up, in the state or in the model.
    NonFinite,
    /// The matrix of Newton's method has no factors.
    SingularTangent {
        /// The unknown at which elimination stopped.
        unknown: usize,
    },
    /// Newton's method came to no end.
    NewtonStalled {
        /// Iterations done.
        iterations: u32,
        /// The last increment, relative to the state.
        residual: f64,
        /// What was asked for.
        tolerance: f64,
    },
    /// The fixed-point iteration came to no end, and nothing else was allowed.
    FixedPointStalled {
        /// Iterations done.
        iterations: u32,
        /// The last increment, relative to the state.
        residual: f64,
        /// What was asked for.
        tolerance: f64,
    },
    /// The change between velocities and momenta failed at a point of the element.
    Legendre(LegendreError),
}

impl From<LegendreError> for StepError {
    fn from(error: LegendreError) -> Self {
        match error {
            LegendreError::NonFinite => Self::NonFinite,
            error => Self::Legendre(error),
        }
    }
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InvalidStep { step } => {
                write!(f, "the step is {step}, but it must be finite and not zero")
            }
            Self::Workspace { needed, given } => {
                write!(
                    f,
                    "the workspace has {given} numbers, the element needs {needed}"
                )
            }
            Self::NonFinite => f.write_str("a value is not finite"),
            Self::SingularTangent { unknown } => {
                write!(f, "the tangent is singular at unknown {unknown}")
            }
            Self::NewtonStalled {
                iterations,
                residual,
                tolerance,
            } => write!(
                f,
                "Newton's method stalled: increment {residual:.1e} after {iterations} iterations, \
                 tolerance {tolerance:.1e}"
            ),
            Self::FixedPointStalled {
                iterations,
                residual,
                tolerance,
            } => write!(
                f,
                "the fixed-point iteration stalled: increment {residual:.1e} after {iterations} \
                 iterations, tolerance {tolerance:.1e}"
            ),
            Self::Legendre(source) => source.fmt(f),
        }
    }
}

impl core::error::Error for StepError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            // Its text is the source's own.
            Self::Legendre(source) => source.source(),
            _ => None,
        }
    }
}
