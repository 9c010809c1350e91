//! What closes orbits of models of either kind of length.

use crate::assembly::Solution;
use crate::length::{FixedLength, Length};
use crate::motion::{Motion, Node};
use nalgebra::DMatrix;
use tfe_runtime::{Model, State, Statistics};

/// A [`Length`] whose models can have periodic orbits; internal.
#[cfg_attr(
    not(feature = "sparse"),
    diagnostic::on_unimplemented(
        message = "periodic orbits of models of run-time length need the feature `sparse`"
    )
)]
pub trait Closed<M, const N: usize>: Length<N> {
    /// A chain of elements that is solved.
    type Solution<'m>: Chained<N, Self>
    where
        M: 'm;
}

/// A chain of elements over one period.
pub trait Chained<const N: usize, L: Length<N>> {
    /// The length of all of it.
    fn period(&self) -> f64;

    /// The state at its start.
    fn start(&self) -> L::State;

    /// The ends of the elements, in order.
    fn nodes(&self) -> Vec<Node<N, L>>;

    /// The transition matrices of the elements.
    fn transitions(&self) -> Vec<DMatrix<f64>>;

    /// Lengths of so many elements, each with the same piece of the orbit.
    fn equidistributed(&self, elements: usize) -> Vec<f64>;

    /// What the solution cost.
    fn statistics(&self) -> &Statistics;

    /// Through the polynomials of the elements.
    fn motion(&self) -> Motion<N, L>;
}

impl<M: Model<N>, const N: usize> Closed<M, N> for FixedLength {
    type Solution<'m>
        = Solution<'m, M, N>
    where
        M: 'm;
}

impl<M: Model<N>, const N: usize> Chained<N, FixedLength> for Solution<'_, M, N> {
    fn period(&self) -> f64 {
        self.length
    }

    fn start(&self) -> State<N> {
        self.start()
    }

    fn nodes(&self) -> Vec<Node<N>> {
        self.nodes()
    }

    fn transitions(&self) -> Vec<DMatrix<f64>> {
        self.matrices()
    }

    fn equidistributed(&self, elements: usize) -> Vec<f64> {
        let nodes = self.iterate.nodes.iter();
        let nodes: Vec<_> = nodes.map(|state| [&state.p[..], &state.q]).collect();
        self.mesh.equidistributed(&nodes, elements)
    }

    fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    fn motion(&self) -> Motion<N> {
        self.motion()
    }
}
