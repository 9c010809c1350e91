//! Where runs end, and how they go on.

use crate::length::{FixedLength, Length};

/// The end of a run, with all that the next step depends on: the state to more than its rounded numbers, the polynomial of the last element, factors of its matrix, the grid.
///
/// One run and two halves of it are the same to the last bit: [`Simulation::resume`](crate::Simulation::resume). It belongs to the model, with the same parameters, and holds the memory of a
/// stepper, some kilobytes for a few coordinates.
#[derive(Clone, Debug)]
pub struct Checkpoint<const N: usize, L: Length<N> = FixedLength> {
    pub(crate) reached: Reached,
    pub(crate) state: L::State,
    pub(crate) velocity: L::Vector,
    pub(crate) stepper: L::Suspended,
}

impl<const N: usize, L: Length<N>> Checkpoint<N, L> {
    /// The time that the run has reached.
    pub fn time(&self) -> f64 {
        self.reached.time
    }

    /// The state there.
    pub fn state(&self) -> &L::State {
        &self.state
    }
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
