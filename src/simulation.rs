//! Simulations: integrate a model over a time span with a chosen element and step size.

mod accurate;
mod acting;
mod checkpoint;
mod checks;
mod differentiable;
mod events;
mod follow;
mod gradient;
mod held;
mod hessian;
mod impulses;
mod inputs;
mod kind;
mod linearise;
mod masses;
pub(crate) mod mesh;
mod pieces;
mod progress;
mod recorder;
mod resolution;
#[cfg(feature = "sparse")]
mod retrace;
mod run;
mod section;
mod sensitive;
mod sequence;
mod setup;
mod steps;
pub(crate) mod times;
mod trail;
mod watch;

pub use crate::motion::Checkpoint;
pub(crate) use crate::motion::Reached;
pub use crate::motion::Warning;
pub use accurate::Accurate;
pub(crate) use checks::{check_breaks, check_constraints, check_start, check_tolerance};
pub(crate) use differentiable::Differentiable;
pub use events::act::{Act, Crossing, Event, Occurrence};
pub use events::settings::Settings;
pub(crate) use events::watching::{Settable, Watching};
pub use held::{Held, HeldNode};
pub(crate) use kind::Simulated;
pub use section::{Section, SectionPoint};
pub use setup::Simulation;
pub use steps::Steps;
pub(crate) use watch::is_jump;
