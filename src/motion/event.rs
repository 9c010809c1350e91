//! Events that a run has met.

use crate::length::{FixedLength, Length};

/// An event that was met, with the state before anything is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Event<const N: usize, L: Length<N> = FixedLength> {
    /// The output that changed its sign.
    pub name: String,
    /// When.
    pub t: f64,
    /// Generalized coordinates.
    pub q: L::Vector,
    /// Velocities dq/dt.
    pub v: L::Vector,
    /// Generalized momenta.
    pub p: L::Vector,
    /// Whether it went from below zero to above.
    pub rises: bool,
}

impl<const N: usize, L: Length<N>> Event<N, L> {
    /// The point of phase space, without the time.
    pub fn state(&self) -> L::State {
        L::state(self.q.clone(), self.p.clone())
    }
}
