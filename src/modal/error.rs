//! Why a model has no modes.

use std::error::Error;
use std::fmt;
use tfe_runtime::family;

/// Why a [`Modal`](super::Modal) could not be made of a model.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ModalError {
    /// Second derivatives of the energy function are not constant.
    NotLinear,
    /// The time appears in the model.
    TimeDependent,
    /// There are generalized forces or dissipation.
    Forced,
    /// There are constraints.
    Constrained,
    /// A velocity (or momentum) is multiplied by a coordinate. Modes are complex where ∂²L/∂v∂q is not symmetric. A symmetric part is the time derivative ½ d(q·S q)/dt: in a Lagrangian it moves nothing
    /// and can be left out.
    VelocityCoupling {
        /// The velocity. Of the entries those are told first that have no equal counterpart.
        velocity: usize,
        /// The coordinate.
        coordinate: usize,
    },
    /// The kinetic energy is not positive for every velocity.
    MassNotPositive,
    /// An entry of the matrices is not finite.
    NotFinite,
    /// There is no such number of modes.
    Modes {
        /// How many were asked for.
        modes: usize,
        /// How many coordinates there are.
        coordinates: usize,
    },
    /// The iteration for eigenvalues did not end.
    NoEigenvalues,
    /// Lengths of a model of run-time length do not belong together.
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
            Self::TimeDependent => write!(f, "{WHO} the time appears in this one"),
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
                 unless such terms are the time derivative of a function of the coordinates; leave those out, they move nothing"
            ),
            Self::MassNotPositive => f.write_str(
                "the kinetic energy must be positive for every velocity; is a mass zero?",
            ),
            Self::NotFinite => f.write_str(
                "an entry of the mass or stiffness matrix is not finite; look at the parameters",
            ),
            Self::Modes { modes, coordinates } => write!(
                f,
                "{modes} modes were asked for, but a model of {coordinates} coordinates has 1 to {coordinates}"
            ),
            Self::NoEigenvalues => {
                f.write_str("the iteration for the eigenvalues of the stiffness did not end")
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
