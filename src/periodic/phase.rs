//! Phase conditions, and the period.

use super::error::OrbitError;

/// The phase condition: selects one of the orbits of an autonomous model that differ only in where the period begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Phase {
    /// Each Newton correction is orthogonal to the flow, ∫ ẏ·δy dt = 0, so that the phase stays that of the guess.
    #[default]
    Orthogonal,
    /// A coordinate has a given value at the start. The orbit must cross that value: q̇ ≠ 0 there.
    Coordinate {
        /// The index of the coordinate.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A momentum has a given value at the start; zero for a turning point of a coordinate with a momentum of its own.
    Momentum {
        /// The index of the momentum.
        index: usize,
        /// Its value.
        value: f64,
    },
}

/// The period of an orbit: known, or a first guess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Period {
    Missing,
    Known(f64),
    Guess(f64),
}

impl Period {
    pub(super) fn checked(self) -> Result<f64, OrbitError> {
        match self {
            Self::Missing => Err(OrbitError::NoPeriod),
            // Below all normal numbers a period would be lost when it is divided.
            Self::Known(period) | Self::Guess(period) if period.is_normal() && period > 0.0 => {
                Ok(period)
            }
            Self::Known(period) | Self::Guess(period) => Err(OrbitError::Period { period }),
        }
    }
}
