//! The interface between periodic orbits and the two kinds of length of models.

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
    /// The type of a solved chain of elements.
    type Solution<'m>: Chained<N, Self>
    where
        M: 'm;
}

/// A chain of elements over one period.
pub trait Chained<const N: usize, L: Length<N>> {
    /// The period.
    fn period(&self) -> f64;

    /// The state at the start of the period.
    fn start(&self) -> L::State;

    /// The nodes, in order.
    fn nodes(&self) -> Vec<Node<N, L>>;

    /// The transition matrices of the elements, in order.
    fn transitions(&self) -> Vec<DMatrix<f64>>;

    /// Element lengths that give each of `elements` elements the same arc length of the orbit.
    fn equidistributed(&self, elements: usize) -> Vec<f64>;

    /// Counts of iterations, evaluations and factorisations of the solution.
    fn statistics(&self) -> &Statistics;

    /// The motion with dense output from the polynomials of the elements.
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
