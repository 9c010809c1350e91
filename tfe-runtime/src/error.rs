//! Why a step failed.

use crate::consistency::ModelError;
use crate::element::{Element, ElementError};
use crate::model::CoordinateName;
use core::fmt;

/// The message of values that are not finite, of a step and of a Legendre transform.
const NOT_FINITE: &str = "a value of the model or of the state is not finite: look for a singular point of the model, such as a division by zero or the root of a negative number, or take a shorter step";

/// Why the Legendre transform at a point, from velocity to momentum or back, failed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LegendreError {
    /// ∂²L/∂v² (or ∂²H/∂p²) is singular: no velocity (momentum) belongs to the other, or many.
    Singular {
        /// The coordinate at which elimination stopped.
        coordinate: usize,
    },
    /// Newton's iteration did not converge.
    Stalled {
        /// The number of iterations done.
        iterations: u32,
        /// The largest component of the remaining residual p − L_v (or v − H_p).
        residual: f64,
    },
    /// A value of the model, or a component of the state, is not finite.
    NonFinite,
}

impl fmt::Display for LegendreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Singular { coordinate } => write!(
                f,
                "the matrix of second derivatives with respect to the velocities (momenta) is singular at coordinate {coordinate}: look for a coordinate without kinetic energy or a singular point of the model; \
                 a Hamiltonian that is linear in a momentum needs an element without velocities, such as `Mixed`"
            ),
            Self::Stalled {
                iterations,
                residual,
            } => write!(
                f,
                "the velocity (momentum) was not found in {iterations} iterations: the residual is still {residual:.1e}; there may be none: take a shorter step, or begin elsewhere"
            ),
            Self::NonFinite => f.write_str(NOT_FINITE),
        }
    }
}

impl core::error::Error for LegendreError {}

/// What is wrong with the constraints of a model, or with a state under them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ConstraintError {
    /// The element has no multipliers for a constraint of this kind.
    Element {
        /// The element.
        element: Element,
        /// The first constraint that the element cannot enforce.
        constraint: &'static str,
    },
    /// The start violates the constraints.
    Start {
        /// The most violated constraint.
        constraint: CoordinateName,
        /// Whether it is violated by the positions; otherwise by the velocities.
        position: bool,
        /// The size of the violation: |φ| or |A v + a|, divided by the norm of its row.
        residual: f64,
    },
    /// The value of a constraint on positions jumps, at a time or at a position, so that the motion would have to jump, too.
    Discontinuous {
        /// The constraint.
        constraint: CoordinateName,
        /// The distance of the positions from those that it allows behind the jump.
        distance: f64,
    },
    /// Some rows of the constraints are linearly dependent, and the redundant constraints are violated: either the
    /// constraints contradict each other, or the motion has met a singular position.
    Dependent {
        /// The violated constraint.
        constraint: &'static str,
        /// The size of the violation, as in [`ConstraintError::Start`].
        residual: f64,
    },
    /// Equations with constraints cannot be solved by fixed-point iteration; Newton's method can.
    NeedsNewton,
    /// No unique velocity belongs to the momentum: the kinetic energy is singular for motions that the constraints
    /// allow.
    SingularMass,
    /// Some rows of the constraints of a model of run-time length are linearly dependent, which its sparse
    /// factorisation does not allow; or the kinetic energy is singular for motions that the constraints allow.
    DependentRows,
    /// The number of independent constraints differs between nodes.
    RankChanged,
    /// A derivative by a parameter was requested that the model does not provide: see
    /// [`Model::parameters`](crate::Model::parameters).
    Parameter,
}

impl fmt::Display for ConstraintError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Element {
                element,
                constraint,
            } => write!(
                f,
                "`{element}` does not support the constraint `{constraint}`: use `Mixed::<{}>`",
                element.nodes()
            ),
            Self::Start {
                constraint,
                position,
                residual,
            } => write!(
                f,
                "the start violates the constraint `{constraint}`: {} {residual:.1e}; `consistent_state` finds the nearest start that satisfies it",
                if *position {
                    "position off by"
                } else {
                    "velocity off by"
                }
            ),
            Self::Discontinuous {
                constraint,
                distance,
            } => write!(
                f,
                "the constraint `{constraint}` jumps, which no motion can follow: behind the jump the positions are off by {distance:.1e}; its value must be continuous in time and in the coordinates, and so must inputs on which it depends"
            ),
            Self::Dependent {
                constraint,
                residual,
            } => write!(
                f,
                "the constraints are dependent, and `{constraint}`, which should follow from the others, is off by {residual:.1e}: the constraints contradict each other, or the position is singular"
            ),
            Self::NeedsNewton => f.write_str(
                "models with constraints need Newton's method, which the fixed-point iteration cannot replace: use `Solve::Auto` or `Solve::Newton`",
            ),
            Self::SingularMass => {
                f.write_str("the mass matrix is singular for motions that the constraints allow: give every coordinate a mass, or constrain those without")
            }
            Self::DependentRows => f.write_str(
                "the constraints are dependent, which models of run-time length do not support: remove constraints that follow from others (or the mass matrix is singular for motions that they allow)",
            ),
            Self::RankChanged => {
                f.write_str("the number of independent constraints changes along the motion: it passes a singular position, across which there are no derivatives on the constraints")
            }
            Self::Parameter => f.write_str(
                "the model has no derivative with respect to this parameter: it is not in the list of its parameters",
            ),
        }
    }
}

impl core::error::Error for ConstraintError {}

/// Why a step failed. The place of the failure is added by the caller that counts the steps.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// The length of a step is zero or not finite.
    InvalidStep {
        /// Length of the element.
        step: f64,
    },
    /// The memory provided by the caller is too small for the element.
    Workspace {
        /// The required length.
        needed: usize,
        /// The length provided.
        given: usize,
    },
    /// A value of the model, or a component of the state, is not finite.
    NonFinite,
    /// An index made of fields is outside its array, or a vector has another length than its indices require:
    /// [`Model::check`](crate::Model::check) says which.
    Inconsistent,
    /// The matrix of Newton's method is singular.
    SingularTangent {
        /// The unknown at which elimination stopped.
        unknown: usize,
    },
    /// Newton's method did not converge.
    NewtonStalled {
        /// The number of iterations done.
        iterations: u32,
        /// The last increment, relative to the state.
        residual: f64,
        /// The requested tolerance.
        tolerance: f64,
    },
    /// An iteration did not converge in a model whose forces have kinks or jumps, where steps do not end.
    StalledAcrossKinks {
        /// The number of iterations done.
        iterations: u32,
        /// The last increment, relative to the state.
        residual: f64,
        /// The requested tolerance.
        tolerance: f64,
    },
    /// The fixed-point iteration did not converge, and Newton's method was not allowed.
    FixedPointStalled {
        /// The number of iterations done.
        iterations: u32,
        /// The last increment, relative to the state.
        residual: f64,
        /// The requested tolerance.
        tolerance: f64,
    },
    /// The iteration converged, but did not contract from its first step on: what it found may be another root of the
    /// equations, as may happen in long steps.
    Unproven {
        /// The largest ratio of an increment to the one before.
        ratio: f64,
    },
    /// Newton's method converged to an end with a different energy, although the model conserves energy: the root
    /// belongs to another motion, or the step has passed over a singular point.
    EnergyJump {
        /// The energy at the start of the step.
        before: f64,
        /// The energy at its end.
        after: f64,
    },
    /// After crossing a jump of a force, or of the gradient of a constraint, the motion returns to it at once: it would
    /// slide along the jump (Filippov), which the equations as declared do not describe.
    Slides,
    /// The step crosses more kinks or jumps of forces and constraints than it can be cut at.
    TooManyKinks,
    /// The Legendre transform failed at a point of the element.
    Legendre(LegendreError),
    /// A problem with the constraints.
    Constraint(ConstraintError),
}

impl StepError {
    /// The same of a step that may have crossed kinks or jumps of forces, which are then the likely reason why an
    /// iteration did not converge.
    #[must_use]
    pub fn across_kinks(self) -> Self {
        match self {
            Self::NewtonStalled {
                iterations,
                residual,
                tolerance,
            }
            | Self::FixedPointStalled {
                iterations,
                residual,
                tolerance,
            } => Self::StalledAcrossKinks {
                iterations,
                residual,
                tolerance,
            },
            other => other,
        }
    }
}

impl From<ConstraintError> for StepError {
    fn from(error: ConstraintError) -> Self {
        Self::Constraint(error)
    }
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
                    "the workspace has {given} numbers, but the element needs {needed}"
                )
            }
            Self::NonFinite => f.write_str(NOT_FINITE),
            Self::Inconsistent => f.write_str(
                "an index or the length of a vector does not fit the model: its `check` says which",
            ),
            Self::SingularTangent { unknown } => {
                write!(f, "the tangent matrix is singular at unknown {unknown}, so that the element does not determine the motion: look for a coordinate without kinetic energy, or take a shorter step")
            }
            Self::NewtonStalled {
                iterations,
                residual,
                tolerance,
            } => write!(
                f,
                "Newton's method did not converge: after {iterations} iterations the increment is {residual:.1e}, the tolerance {tolerance:.1e}; take a shorter step"
            ),
            Self::StalledAcrossKinks {
                iterations,
                residual,
                tolerance,
            } => write!(
                f,
                "the iteration did not converge: after {iterations} iterations the increment is {residual:.1e}, the tolerance {tolerance:.1e}; \
                 forces of the model have kinks or jumps (`sign`, `abs`, `select` or the like), and where a jump holds the motion, as dry friction at rest, no step is short enough: \
                 end steps there with `at_kinks(true)`, replace a jump by a continuous law, such as tanh(v/w) for sign(v), or take a shorter step"
            ),
            Self::FixedPointStalled {
                iterations,
                residual,
                tolerance,
            } => write!(
                f,
                "the fixed-point iteration did not converge: after {iterations} iterations the increment is {residual:.1e}, the tolerance {tolerance:.1e}; take a shorter step"
            ),
            Self::Unproven { ratio } => write!(
                f,
                "the iteration converged irregularly (an increment was {ratio:.1e} times the one before) and may have found a solution of the equations that is not the motion: \
                 take a shorter step, or accept any solution with `Solve::Trusting`"
            ),
            Self::EnergyJump { before, after } => write!(
                f,
                "the energy, which the model conserves, jumps from {before:.6e} to {after:.6e}: the step found a solution of the equations that is not the motion, or crosses a singular point of the model; \
                 take a shorter step, or accept any solution with `Solve::Trusting`"
            ),
            Self::Slides => f.write_str(
                "the motion slides along a jump of a force, or of the gradient of a constraint: on either side of a change of a `sign`, `select` or the like, it is driven back to the other side; \
                 replace the jump by a continuous law, such as tanh(v/w) for sign(v)",
            ),
            Self::TooManyKinks => f.write_str(
                "the step crosses kinks or jumps of forces and constraints more often than it can be cut: take a shorter step",
            ),
            Self::Legendre(source) => source.fmt(f),
            Self::Constraint(source) => source.fmt(f),
        }
    }
}

impl core::error::Error for StepError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            // The text is that of the source itself, which is therefore skipped.
            Self::Legendre(source) => source.source(),
            Self::Constraint(source) => source.source(),
            _ => None,
        }
    }
}

/// Why a transition matrix could not be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TransitionError {
    /// The element is invalid.
    Element(ElementError),
    /// The step itself failed, or its tangent is singular.
    Step(StepError),
    /// No step has been made whose transition matrix could be computed.
    NoStep,
    /// An impulse acts inside an element whose start or end moves, for example with an event: the change of its place
    /// in the element is not differentiated.
    MovedImpulse {
        /// The time of the impulse.
        time: f64,
    },
    /// The memory for the result is too small.
    Shape {
        /// The required length.
        needed: usize,
        /// The length provided.
        given: usize,
    },
}

impl From<ElementError> for TransitionError {
    fn from(error: ElementError) -> Self {
        Self::Element(error)
    }
}

impl From<ModelError> for TransitionError {
    fn from(error: ModelError) -> Self {
        match error {
            ModelError::Element(error) => Self::Element(error),
            _ => Self::Step(StepError::Inconsistent),
        }
    }
}

impl From<StepError> for TransitionError {
    fn from(error: StepError) -> Self {
        Self::Step(error)
    }
}

impl fmt::Display for TransitionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Element(error) => error.fmt(f),
            Self::Step(error) => error.fmt(f),
            Self::NoStep => f.write_str("no step has been taken: make one first"),
            Self::MovedImpulse { time } => write!(
                f,
                "the impulse at t = {time} acts inside an element that an event cuts: end an element there with `break_at({time})`"
            ),
            Self::Shape { needed, given } => {
                write!(
                    f,
                    "the memory for the transition matrix has {given} numbers, but the matrix needs {needed}"
                )
            }
        }
    }
}

impl core::error::Error for TransitionError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Element(error) => error.source(),
            Self::Step(error) => error.source(),
            _ => None,
        }
    }
}
