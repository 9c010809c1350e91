//! The errors of periodic orbits.

use crate::assembly::{AssemblyError, MeshError};
use crate::error::RunErrorKind;
use crate::numbers::Short;
use crate::periodic_schur::PeriodicSchurError;
use std::fmt;
use tfe_runtime::{LegendreError, StepError};

/// Why a periodic orbit was not found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum OrbitError {
    /// No period was given, neither as a known value nor as a guess.
    NoPeriod,
    /// The period, as given or as found, is not a positive number, or is below all normal numbers.
    Period {
        /// The period given or found.
        period: f64,
    },
    /// A number that was given is infinite or not a number.
    Number {
        /// The setting to which it was given, such as `period`.
        what: &'static str,
        /// The number given.
        value: f64,
    },
    /// The equations of motion are others after the period, at the coordinates grown by the
    /// [`advance`](super::PeriodicOrbit::advance): the state closes, but the motion does not repeat.
    NotRepeated {
        /// The period given, or that of the parameter.
        period: f64,
        /// The time from which a period leads to the largest difference.
        time: f64,
        /// The difference of the rates dp/dt and dq/dt, as part of the largest along the orbit.
        off: f64,
    },
    /// The model depends on time: the period of its orbits is that of the forcing (or a multiple), not an unknown.
    ForcedPeriod,
    /// The mesh is invalid.
    Mesh(MeshError),
    /// The phase condition names a coordinate that does not exist.
    Phase {
        /// The index of that coordinate.
        index: usize,
    },
    /// The run that was to provide the first guess failed.
    Guess(RunErrorKind),
    /// A run of a motion with events failed.
    Run(RunErrorKind),
    /// An event stopped a motion before the end of its period.
    Stopped {
        /// The time of the event.
        time: f64,
    },
    /// At the end of the period, events have left a parameter with another value than at the start: the state repeats,
    /// the model does not.
    ParameterLeft {
        /// The name of the parameter.
        parameter: String,
        /// Its value at the end of the period.
        value: f64,
    },
    /// For orbits with events: Newton's corrections no longer bring the end of the motion nearer to its start.
    Stalled {
        /// The distance between start and end, relative to the size of the motion.
        residual: f64,
        /// The number of corrections made.
        iterations: u32,
    },
    /// The call is not supported for this kind of model, or has no meaning for orbits of this kind.
    Unsupported {
        /// The call.
        call: &'static str,
        /// The kind of models, or of orbits.
        of: &'static str,
    },
    /// The solution found does not move: it is an equilibrium, which repeats after any time, or the period shrinks to
    /// zero.
    AtRest,
    /// The assembled equations could not be solved.
    Assembly(AssemblyError),
    /// An autonomous model has no orbit of this period: the equations hold only with an additional force γ v.
    NoFamily {
        /// The γ that would be needed.
        unfolding: f64,
    },
    /// The constraints do not allow the same number of independent motions at all nodes, or no velocity belongs to the
    /// momenta at a node.
    Constraints(StepError),
    /// The multipliers could not be computed.
    Multipliers(PeriodicSchurError),
    /// The lengths of a model of run-time length do not fit each other, or its steps cannot be differentiated.
    #[cfg(feature = "sparse")]
    Family(tfe_runtime::family::OperatorError),
}

impl From<AssemblyError> for OrbitError {
    fn from(error: AssemblyError) -> Self {
        Self::Assembly(error)
    }
}

impl From<MeshError> for OrbitError {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

impl From<LegendreError> for OrbitError {
    fn from(error: LegendreError) -> Self {
        Self::Assembly(error.into())
    }
}

impl fmt::Display for OrbitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPeriod => {
                f.write_str("no period is set: give `.period(T)`, or `.unknown_period(guess)` for an autonomous model")
            }
            Self::Period { period } => write!(
                f,
                "the period is {}, it must be positive, finite and at least {:.1e}",
                Short(*period),
                f64::MIN_POSITIVE
            ),
            Self::Number { what, value } => {
                write!(f, "the {what} is {}, it must be finite", Short(*value))
            }
            Self::NotRepeated { period, time, off } => write!(
                f,
                "the model does not repeat after the period {}: from t = {} to a period later, the rates of the motion change by {off:.1e} of their size; \
                 give a multiple of the period of the forces, with all its digits, and an `.advance(…)` that changes nothing",
                Short(*period),
                Short(*time)
            ),
            Self::ForcedPeriod => f.write_str(
                "the model depends on time, so its orbits have the period of the forcing: give it with `.period(T)`",
            ),
            Self::Mesh(error) => error.fmt(f),
            Self::Unsupported { call, of } => write!(f, "`{call}` is not supported for {of}"),
            Self::Phase { index } => {
                write!(f, "the phase condition names coordinate {index}, which does not exist: indices begin with 0")
            }
            Self::Guess(error) => write!(f, "the run for the first guess failed: {error}"),
            Self::Run(error) => write!(f, "a run in the search for the orbit failed: {error}"),
            Self::Stopped { time } => {
                let time = Short(*time);
                write!(f, "an event ends the motion at t = {time}, before a period has passed: let it go on there, for example with `Act::Restart`")
            }
            Self::ParameterLeft { parameter, value } => write!(
                f,
                "events leave `{parameter}` at {} after a period, which is not its value at the start: let an event of the period set it back",
                Short(*value)
            ),
            Self::Stalled {
                residual,
                iterations,
            } => write!(
                f,
                "no orbit near the guess: after {iterations} corrections the end of the motion differs from its start by {residual:.1e} of the motion; begin nearer to the orbit, or take more elements"
            ),
            Self::AtRest => f.write_str(
                "the search for an orbit ends at an equilibrium, which repeats after any time: begin from a moving state nearer to the orbit \
                 (for the multipliers of the equilibrium itself, give `.period(T)` and a guess at rest)",
            ),
            Self::Assembly(error) => error.fmt(f),
            Self::NoFamily { unfolding } => write!(
                f,
                "no orbit of this period near the guess: only an additional force {unfolding:.1e} v closes it; \
                 if the model has an isolated orbit, give `.unknown_period(guess)`"
            ),
            Self::Constraints(error) => write!(
                f,
                "the motions that the constraints allow cannot be found at all nodes: {error}"
            ),
            Self::Multipliers(error) => write!(f, "the Floquet multipliers cannot be computed: {error}"),
            #[cfg(feature = "sparse")]
            Self::Family(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for OrbitError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Mesh(error) => Some(error),
            Self::Guess(error) | Self::Run(error) => Some(error),
            Self::Assembly(error) => error.source(),
            Self::Multipliers(error) => Some(error),
            #[cfg(feature = "sparse")]
            Self::Family(error) => error.source(),
            _ => None,
        }
    }
}
