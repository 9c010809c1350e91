//! Events that a run has met.

use tfe_runtime::State;

/// An event that was met, with the state before anything is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Event<const N: usize> {
    /// The output that changed its sign.
    pub name: String,
    /// When.
    pub t: f64,
    /// Generalized coordinates.
    pub q: [f64; N],
    /// Velocities dq/dt.
    pub v: [f64; N],
    /// Generalized momenta.
    pub p: [f64; N],
    /// Whether it went from below zero to above.
    pub rises: bool,
}

impl<const N: usize> Event<N> {
    /// The point of phase space, without the time.
    pub fn state(&self) -> State<N> {
        State {
            q: self.q,
            p: self.p,
        }
    }
}
