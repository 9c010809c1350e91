//! Models of run-time length: `coordinates(q[n])` with n a field of the struct.
//!
//! [`Simulation::new`](crate::Simulation::new) runs them as it runs models of fixed size; the types here are those that it gives. The example is
//! at [`FamilySimulation`].

pub use crate::motion::family::{FamilyMotion, FamilyNode, FamilyResidual};
pub use crate::simulation::family::{FamilyRunError, FamilySimulation, FamilySteps, Runs};
pub use tfe_runtime::family::{
    Block, Entries, FamilyError, FamilyModel, FamilyState, FamilyStepper, Gradient, Pattern,
    constraint_residual, energy, momenta, state, velocity,
};
pub use tfe_runtime::length::{Declared, FixedLength, RunTimeLength};
