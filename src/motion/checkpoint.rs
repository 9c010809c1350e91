//! Where runs end, and how they go on.

use tfe_runtime::State;
use tfe_runtime::family::{FamilyState, FamilySuspended};
use tfe_runtime::step::Suspended;

/// The end of a run, with all that the next step depends on: the state to more than its rounded numbers, the polynomial of the last element, factors of its matrix, the grid.
///
/// One run and two halves of it are the same to the last bit: [`Simulation::resume`](crate::Simulation::resume). It belongs to the model, with the same parameters, and holds the memory of a
/// stepper, some kilobytes for a few coordinates.
#[derive(Clone, Debug)]
pub struct Checkpoint<const N: usize> {
    pub(crate) reached: Reached,
    pub(crate) state: State<N>,
    pub(crate) velocity: [f64; N],
    pub(crate) stepper: Suspended<N>,
}

/// How far a run has got on its grid.
#[derive(Clone, Debug)]
pub(crate) struct Reached {
    /// Where it began.
    pub(crate) origin: f64,
    pub(crate) step: Option<f64>,
    /// How many elements were done.
    pub(crate) elements: usize,
    pub(crate) time: f64,
}

/// The end of a family's run, with all that the next step depends on: what [`Checkpoint`](crate::Checkpoint) is for models of fixed size.
///
/// One run and two halves of it are the same to the last bit: [`FamilySimulation::resume`](crate::family::FamilySimulation::resume). It belongs to the model, with the same parameters, and holds the memory of a
/// stepper.
#[derive(Clone, Debug)]
pub struct FamilyCheckpoint {
    pub(crate) reached: Reached,
    pub(crate) state: FamilyState,
    pub(crate) stepper: FamilySuspended,
}

impl FamilyCheckpoint {
    /// The time that the run has reached.
    pub fn time(&self) -> f64 {
        self.reached.time
    }

    /// The state there.
    pub fn state(&self) -> &FamilyState {
        &self.state
    }
}
