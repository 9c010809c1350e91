//! The errors of modal reduction.

use std::error::Error;
use std::fmt;
use tfe_runtime::family;

/// Why a model cannot be reduced to its modes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ModalError {
    /// The model is not linear: second derivatives of its energy function are not constant.
    NotLinear,
    /// The model depends on time.
    TimeDependent,
    /// The model has generalized forces or dissipation.
    Forced,
    /// The model has constraints.
    Constrained,
    /// A velocity (or momentum) is multiplied by a coordinate. If ∂²L/∂v∂q is not symmetric, the modes are complex
    /// (gyroscopic forces). A symmetric part is the total time derivative ½ d(q·S q)/dt: in a Lagrangian it has no
    /// effect and can be left out.
    VelocityCoupling {
        /// The index of the velocity. If ∂²L/∂v∂q is not symmetric, velocity and coordinate are those of an entry that
        /// differs from its transposed one.
        velocity: usize,
        /// The index of the coordinate.
        coordinate: usize,
    },
    /// The mass matrix is not positive definite.
    MassNotPositive,
    /// An entry of the matrices is not finite.
    NotFinite,
    /// The number of modes asked for is zero or larger than the number of coordinates.
    Modes {
        /// The number asked for.
        modes: usize,
        /// The number of coordinates.
        coordinates: usize,
    },
    /// The iteration for eigenvalues did not converge.
    NoEigenvalues,
    /// The model does not pass its [check](crate::Model::check): lengths or indices do not fit each other.
    Family(family::ModelError),
}

impl fmt::Display for ModalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const WHO: &str = "only a linear model without forces has modes of this kind, and";
        match self {
            Self::NotLinear => write!(
                f,
                "{WHO} the energy function is not quadratic; write it for small motions about its equilibrium"
            ),
            Self::TimeDependent => write!(f, "{WHO} this one depends on time"),
            Self::Forced => write!(
                f,
                "{WHO} this one has forces or dissipation; a constant force belongs into the energy function"
            ),
            Self::Constrained => write!(
                f,
                "{WHO} this one has constraints; eliminate them, or put stiff springs in their place"
            ),
            Self::VelocityCoupling {
                velocity,
                coordinate,
            } => write!(
                f,
                "{WHO} velocity {velocity} is multiplied by coordinate {coordinate} in this one: its modes would be complex, \
                 unless such terms are the time derivative of a function of the coordinates; leave those out, they have no effect"
            ),
            Self::MassNotPositive => f.write_str(
                "the kinetic energy must be positive for every velocity other than zero; is a mass zero?",
            ),
            Self::NotFinite => f.write_str(
                "an entry of the mass or stiffness matrix is not finite; look at the parameters",
            ),
            Self::Modes { modes, coordinates } => write!(
                f,
                "{modes} modes were asked for, but a model of {coordinates} coordinates has 1 to {coordinates}"
            ),
            Self::NoEigenvalues => {
                f.write_str("the iteration for the eigenvalues of the stiffness matrix did not converge")
            }
            Self::Family(error) => error.fmt(f),
        }
    }
}

impl Error for ModalError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Family(error) => Some(error),
            _ => None,
        }
    }
}
