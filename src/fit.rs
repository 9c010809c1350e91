//! Parameters of a model, found from measured outputs of its motion.

mod data;
mod error;
mod fitted;
mod problem;
mod setup;
mod solve;

pub use error::FitError;
pub use fitted::{Fitted, Trial};
pub use setup::Fit;
