//! Where runs end, and how they go on.

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

/// How far a run has got on its grid.
#[derive(Clone, Debug)]
pub(crate) struct Reached {
    /// Where it began.
    pub(crate) origin: f64,
    pub(crate) step: Option<f64>,
    /// How many elements were done.
    pub(crate) elements: usize,
    pub(crate) time: f64,
    /// That of its last element, which has had the impulses at that time; zero where there was none.
    pub(crate) direction: f64,
}

/// What is known of events where a run has got to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    /// What is looked for.
    pub(crate) names: Vec<String>,
    /// Sides on which the values were seen last; 0 where this is not known.
    pub(crate) sides: Vec<f64>,
    pub(crate) last: Option<LastCut>,
    /// The last cut that each of them has made.
    pub(crate) lasts: Vec<Option<LastCut>>,
    /// Whether one has ended the run.
    pub(crate) has_stopped: bool,
}

impl Seen {
    /// Nothing yet.
    pub(crate) fn nothing(names: Vec<String>) -> Self {
        Self {
            sides: vec![0.0; names.len()],
            lasts: vec![None; names.len()],
            names,
            last: None,
            has_stopped: false,
        }
    }

    /// Goes on with a run that has looked for the same.
    pub(crate) fn go_on(&mut self, seen: &Self) {
        if !self.names.is_empty() && self.names == seen.names {
            self.clone_from(seen);
        }
    }
}

/// An event that cut an element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LastCut {
    pub(crate) time: f64,
    /// Among those that are looked for.
    pub(crate) function: usize,
    pub(crate) rises: bool,
    /// Whether the motion went on as if nothing had happened.
    pub(crate) is_idle: bool,
    /// How fast the surface was met of an impact that has not been seen to throw the motion back; else zero.
    pub(crate) impact: f64,
}
