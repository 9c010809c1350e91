//! Events that a run has met.

use crate::length::{FixedLength, Length};

/// An event of a run: where an event function changed its sign, with the state before anything is done there.
#[derive(Clone, Debug, PartialEq)]
pub struct Event<const N: usize, L: Length<N> = FixedLength> {
    /// The name of the event or output that changed its sign.
    pub name: String,
    /// The time of the event.
    pub t: f64,
    /// Generalized coordinates q.
    pub q: L::Vector,
    /// Velocities dq/dt.
    pub v: L::Vector,
    /// Generalized momenta p = ∂L/∂v.
    pub p: L::Vector,
    /// Whether the function rises, from negative to positive.
    pub rises: bool,
}

impl<const N: usize, L: Length<N>> Event<N, L> {
    /// The state (q, p), without the time.
    pub fn state(&self) -> L::State {
        L::state(self.q.clone(), self.p.clone())
    }
}
