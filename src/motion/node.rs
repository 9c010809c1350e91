//! The nodes of a motion.

use crate::evaluate::Evaluate;
use crate::length::{FixedLength, Length};

/// A state with its time and its velocities. The vectors are arrays for models of fixed size, and `Vec`s for models of
/// run-time length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node<const N: usize, L: Length<N> = FixedLength> {
    /// Time t, in the unit of the model.
    pub t: f64,
    /// Generalized coordinates q.
    pub q: L::Vector,
    /// Generalized momenta p = ∂L/∂v.
    pub p: L::Vector,
    /// Velocities dq/dt. At a node they are the velocities that belong to the momenta, or NaN if there are none;
    /// between nodes the derivative of the element's polynomial.
    pub v: L::Vector,
}

impl<const N: usize, L: Length<N>> Node<N, L> {
    /// A node from a state and its velocity.
    #[inline(always)]
    pub(crate) fn of(t: f64, state: &L::State, v: L::Vector) -> Self {
        let (q, p) = L::parts(state);
        let (q, p) = (q.clone(), p.clone());
        Self { t, q, p, v }
    }

    /// A node of a model; the velocity is found by iteration from `guess`.
    #[inline(always)]
    pub(crate) fn new<M>(model: &M, t: f64, state: &L::State, guess: &L::Vector) -> Self
    where
        M: Evaluate<N, L>,
    {
        Self::found(t, state, model.velocity(t, state, guess), guess)
    }

    /// A node from a state and its velocity, as long as `like`; NaN if there is none.
    fn found(t: f64, state: &L::State, velocity: Option<L::Vector>, like: &L::Vector) -> Self {
        match velocity {
            Some(v) => Self::of(t, state, v),
            None => Self::of(t, state, L::unknown(like)),
        }
    }

    /// The state (q, p), without the time.
    pub fn state(&self) -> L::State {
        L::state(self.q.clone(), self.p.clone())
    }

    /// The product p·v.
    pub(crate) fn action(&self) -> f64 {
        action(self.v.as_ref(), self.p.as_ref())
    }
}

/// The product p·v.
pub(crate) fn action(velocities: &[f64], momenta: &[f64]) -> f64 {
    let products = velocities.iter().zip(momenta);
    products.map(|(v, p)| v * p).sum()
}
