//! Checkpoints: the ends of runs, from which these can be continued.

use crate::length::{FixedLength, Length};

/// The end of a run, with everything on which the next step depends: the state with more digits than its rounded
/// numbers, the polynomial of the last element, the factors of its matrix, the grid of steps.
///
/// With it, [`Simulation::resume`](crate::Simulation::resume) continues the run such that both parts together have the
/// same bits as one run. A checkpoint belongs to its model and that model's parameters. It holds the memory of a
/// stepper, some kilobytes for a few coordinates.
#[derive(Clone, Debug)]
pub struct Checkpoint<const N: usize, L: Length<N> = FixedLength> {
    pub(crate) reached: Reached,
    pub(crate) state: L::State,
    pub(crate) velocity: L::Vector,
    pub(crate) stepper: L::Suspended,
    pub(crate) seen: Seen,
}

impl<const N: usize, L: Length<N>> Checkpoint<N, L> {
    /// The time at which the run ended.
    pub fn time(&self) -> f64 {
        self.reached.time
    }

    /// The state at that time.
    pub fn state(&self) -> &L::State {
        &self.state
    }
}

/// The progress of a run on its mesh.
#[derive(Clone, Debug)]
pub(crate) struct Reached {
    /// The time at which the run began.
    pub(crate) origin: f64,
    pub(crate) step: Option<f64>,
    /// The number of elements that are done.
    pub(crate) elements: usize,
    pub(crate) time: f64,
    /// The direction of the last element, in which impulses at its end have acted; zero if there was none.
    pub(crate) direction: f64,
}

/// The record of events at the end of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    /// The names of the events that are watched.
    pub(crate) names: Vec<String>,
    /// The last signs of the watched functions; 0 if unknown.
    pub(crate) sides: Vec<f64>,
    pub(crate) last: Option<LastCut>,
    /// The last cut by each event.
    pub(crate) lasts: Vec<Option<LastCut>>,
    /// Whether an event has ended the run.
    pub(crate) has_stopped: bool,
}

impl Seen {
    /// The record before a run.
    pub(crate) fn nothing(names: Vec<String>) -> Self {
        Self {
            sides: vec![0.0; names.len()],
            lasts: vec![None; names.len()],
            names,
            last: None,
            has_stopped: false,
        }
    }

    /// Takes over the record of an earlier run that watched the same events.
    pub(crate) fn go_on(&mut self, seen: &Self) {
        if !self.names.is_empty() && self.names == seen.names {
            self.clone_from(seen);
        }
    }
}

/// A cut of an element by an event.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LastCut {
    pub(crate) time: f64,
    /// The index of the event among those watched.
    pub(crate) function: usize,
    pub(crate) rises: bool,
    /// Whether the motion continued unchanged.
    pub(crate) is_idle: bool,
    /// The speed of an impact after which the motion has not yet been seen to rebound; otherwise zero.
    pub(crate) impact: f64,
}
