//! Runs: a model, an element, a step, a span.

mod accurate;
mod checkpoint;
mod checks;
mod course;
mod events;
pub(crate) mod family;
mod follow;
mod gradient;
mod held;
mod inputs;
mod kind;
mod linearise;
pub(crate) mod mesh;
mod pieces;
mod progress;
mod recorder;
mod refused;
mod run;
mod section;
mod sensitive;
mod setup;
mod steps;
mod watch;

pub use crate::motion::Checkpoint;
pub(crate) use crate::motion::Reached;
pub use crate::motion::Warning;
pub use accurate::Accurate;
pub(crate) use checks::{check_constraints, check_start, conserves_energies, conserves_energy};
pub use events::act::{Act, Crossing, Event, Occurrence};
pub use events::settings::Settings;
pub(crate) use events::watching::{Settable, Watching};
pub use held::{Held, HeldNode};
pub use section::{Section, SectionPoint};
pub use setup::Simulation;
pub use steps::Steps;
pub(crate) use watch::is_jump;
