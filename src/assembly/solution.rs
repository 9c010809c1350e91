//! Solved chains of elements.

use super::mesh::Mesh;
use super::newton::Iterate;
use crate::motion::{Motion, Node};
use nalgebra::DMatrix;
use tfe_runtime::condenser::{Condensed, Condenser, Placed};
use tfe_runtime::{Element, Model, State, Statistics};

/// The motion through solved elements, and their transition matrices.
#[derive(Clone, Debug)]
pub(crate) struct Solution<'m, M, const N: usize> {
    pub(crate) model: &'m M,
    pub(crate) element: Element,
    pub(crate) mesh: Mesh,
    /// Time at the start.
    pub(crate) start: f64,
    /// Length of the span.
    pub(crate) length: f64,
    /// γ of an additional force γ v.
    pub(crate) damping: f64,
    pub(crate) iterate: Iterate<N>,
    /// Matrix by matrix, row by row.
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

    pub(crate) fn nodes(&self) -> Vec<Node<N>> {
        let times = self.mesh.times(self.start, self.length);
        let nodes = times.zip(&self.iterate.nodes);
        nodes
            .map(|(t, state)| Node::new(self.model, t, state, &[0.0; N]))
            .collect()
    }

    pub(crate) fn matrices(&self) -> Vec<DMatrix<f64>> {
        matrices::<N>(&self.transitions)
    }

    /// The lengths of so many elements, each with the same arc length in scaled time and phase space.
    pub(crate) fn equidistributed(&self, elements: usize) -> Vec<f64> {
        let nodes = &self.iterate.nodes;
        let component =
            |state: &State<N>, k: usize| if k < N { state.p[k] } else { state.q[k - N] };
        let mut inverse_ranges = vec![0.0; 2 * N];
        for (k, inverse) in inverse_ranges.iter_mut().enumerate() {
            let values = nodes.iter().map(|node| component(node, k));
            let (low, high) = values
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                    (low.min(value), high.max(value))
                });
            if high > low {
                *inverse = 1.0 / (high - low);
            }
        }
        // Arc length at the nodes.
        let mut lengths = vec![0.0];
        let mut total = 0.0;
        for (element, pair) in nodes.windows(2).enumerate() {
            let mut square = self.mesh.share(element).powi(2);
            for (k, inverse) in inverse_ranges.iter().enumerate() {
                let change = component(&pair[1], k) - component(&pair[0], k);
                square += (inverse * change).powi(2);
            }
            total += square.sqrt();
            lengths.push(total);
        }
        // Its inverse at equal parts.
        let times: Vec<f64> = self.mesh.times(0.0, 1.0).collect();
        let mut weights = Vec::with_capacity(elements);
        let (mut at, mut last) = (0, 0.0);
        for k in 1..=elements {
            let length = total * k as f64 / elements as f64;
            while at + 2 < lengths.len() && lengths[at + 1] < length {
                at += 1;
            }
            let part = (length - lengths[at]) / (lengths[at + 1] - lengths[at]);
            let time = times[at] + part.min(1.0) * (times[at + 1] - times[at]);
            weights.push(time - last);
            last = time;
        }
        weights
    }

    /// The motion with the polynomials of the elements.
    pub(crate) fn motion(&self) -> Motion<N> {
        self.motion_told(|_| {})
    }

    /// The same, where the model is told which element comes.
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
        let times: Vec<f64> = self.mesh.times(self.start, self.length).collect();
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
            // This linearisation has been done before: it cannot fail now.
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

/// Transition matrices, ordered (p, q).
pub(crate) fn matrices<const N: usize>(transitions: &[f64]) -> Vec<DMatrix<f64>> {
    let matrices = transitions.chunks_exact(4 * N * N);
    matrices
        .map(|entries| DMatrix::from_row_slice(2 * N, 2 * N, entries))
        .collect()
}
