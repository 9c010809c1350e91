//! Parameter identification: the parameters of a model, fitted to measured outputs of its motion.

mod data;
mod error;
mod fitted;
mod problem;
mod runs;
mod setup;
mod solve;
mod unknowns;

pub use error::FitError;
pub use fitted::{Fitted, Trial};
pub use setup::Fit;
