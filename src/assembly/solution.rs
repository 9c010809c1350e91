//! Solutions of assembled problems.

use super::mesh::Mesh;
use super::newton::Iterate;
use crate::motion::{Motion, Node};
use nalgebra::DMatrix;
use tfe_runtime::condenser::{Condensed, Condenser, Placed};
use tfe_runtime::{Element, Model, State, Statistics};

/// The motion through solved elements, and their transition matrices.
#[derive(Clone, Debug)]
pub struct Solution<'m, M, const N: usize> {
    pub(crate) model: &'m M,
    pub(crate) element: Element,
    pub(crate) mesh: Mesh,
    /// The start time.
    pub(crate) start: f64,
    /// The length of the span.
    pub(crate) length: f64,
    /// The end time, which start + length may miss by rounding.
    pub(crate) end: f64,
    /// γ of an additional force γ v.
    pub(crate) damping: f64,
    pub(crate) iterate: Iterate<N>,
    /// Concatenated, row by row.
    pub(crate) transitions: Vec<f64>,
    pub(crate) statistics: Statistics,
}

impl<M: Model<N>, const N: usize> Solution<'_, M, N> {
    pub(crate) fn start(&self) -> State<N> {
        self.iterate.nodes[0]
    }

    pub(crate) fn end(&self) -> State<N> {
        self.iterate.nodes[self.iterate.nodes.len() - 1]
    }

    /// The times of all nodes.
    pub(crate) fn times(&self) -> Vec<f64> {
        self.mesh.times_to(self.end, self.start, self.length)
    }

    pub(crate) fn nodes(&self) -> Vec<Node<N>> {
        let nodes = self.times().into_iter().zip(&self.iterate.nodes);
        nodes
            .map(|(t, state)| Node::new(self.model, t, state, &[0.0; N]))
            .collect()
    }

    pub(crate) fn matrices(&self) -> Vec<DMatrix<f64>> {
        matrices::<N>(&self.transitions)
    }

    /// The solution as a motion, with the polynomials of the elements.
    pub(crate) fn motion(&self) -> Motion<N> {
        self.motion_told(|_| {})
    }

    /// The same; `tell` is called with the index of each element before it is computed.
    pub(crate) fn motion_told(&self, mut tell: impl FnMut(usize)) -> Motion<N> {
        tell(0);
        let mut motion = Motion::from_start(self.model, self.start, &self.start());
        motion.set_statistics(self.statistics);
        let Ok(mut condenser) = Condenser::new::<M>(self.element) else {
            return motion;
        };
        let m = condenser.interior();
        let columns = 2 * N + 1;
        let (mut ends, mut response) = (vec![0.0; 2 * N * columns], vec![0.0; m * columns]);
        let times = self.times();
        for (element, pair) in self.iterate.nodes.windows(2).enumerate() {
            tell(element);
            let (time, length) = self.mesh.place(element, self.start, self.length);
            let placed = Placed {
                time,
                length,
                start: &pair[0],
                interior: &self.iterate.interiors[element * m..(element + 1) * m],
                damping: self.damping,
            };
            let condensed = Condensed {
                ends: &mut ends,
                response: &mut response,
            };
            // The same linearisation succeeded before, so it cannot fail now.
            if condenser
                .linearise(self.model, placed, &[], condensed)
                .is_err()
            {
                break;
            }
            let next = times[element + 1];
            motion.keep_element(condenser.dense::<M>(placed, next, &pair[1]));
            motion.record(self.model, next, &pair[1]);
        }
        motion
    }
}

/// The transition matrices, in the order (p, q).
pub(crate) fn matrices<const N: usize>(transitions: &[f64]) -> Vec<DMatrix<f64>> {
    let matrices = transitions.chunks_exact(4 * N * N);
    matrices
        .map(|entries| DMatrix::from_row_slice(2 * N, 2 * N, entries))
        .collect()
}
