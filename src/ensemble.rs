//! Ensembles: the same run from many starts, or with many parameter sets.

mod batch;
mod doubts;
mod ends;
mod error;
mod family;
mod members;
mod plan;
mod results;
mod setup;
mod under_way;
mod watched;

pub use doubts::WarningCounts;
pub use ends::{Ends, Failure};
pub use error::EnsembleError;
pub use members::{ManyModels, Members, Models, OneModel};
pub use setup::Ensemble;
pub use under_way::EnsembleRun;
