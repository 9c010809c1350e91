//! A stepper that owns its memory.

mod advance;
mod any;
mod arcs;
mod carried;
mod common;
mod dense;
mod matrices;
mod over;
mod piece;
mod setup;
mod suspended;
mod trail;

pub use setup::Stepper;
pub use suspended::Suspended;
