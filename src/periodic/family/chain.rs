//! The solution of the equations of an orbit.

use super::shooting::Shooting;
use crate::length::RunTimeLength;
use crate::motion::{Motion, Node};
use crate::periodic::kind::{Chained, Closed};
use nalgebra::DMatrix;
use tfe_runtime::Statistics;
use tfe_runtime::family::{self, FamilyState};

impl<M: family::Model> Closed<M, 0> for RunTimeLength {
    type Solution<'m>
        = Shooting<'m, M>
    where
        M: 'm;
}

impl<M: family::Model> Chained<0, RunTimeLength> for Shooting<'_, M> {
    fn period(&self) -> f64 {
        self.period
    }

    fn start(&self) -> FamilyState {
        self.nodes[0].clone()
    }

    fn nodes(&self) -> Vec<Node<0, RunTimeLength>> {
        let times = self.mesh.times(self.start, self.period);
        let nodes = times.zip(&self.nodes);
        nodes
            .map(|(t, state)| Node::new(self.model, t, state, &state.p))
            .collect()
    }

    fn transitions(&self) -> Vec<DMatrix<f64>> {
        self.transitions.clone()
    }

    fn equidistributed(&self, elements: usize) -> Vec<f64> {
        let nodes = self.nodes.iter();
        let nodes: Vec<_> = nodes.map(|state| [&state.p[..], &state.q]).collect();
        self.mesh.equidistributed(&nodes, elements)
    }

    fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    fn motion(&self) -> Motion<0, RunTimeLength> {
        let (start, first) = (self.start, &self.nodes[0]);
        let mut motion = Motion::from_start(self.model, start, first);
        motion.set_statistics(self.statistics);
        // Each element begins exactly where the previous one ends.
        let mut places = Vec::with_capacity(self.mesh.elements());
        let mut t = self.start;
        for e in 0..self.mesh.elements() {
            let h = self.mesh.share(e) * self.period;
            places.push((t, h));
            t += h;
        }
        let steps = places.iter().zip(&self.nodes);
        let steps = steps.map(|((t, h), node)| (*t, *h, node));
        let mut e = 0;
        let each = |transition: family::TransitionOperator| {
            let dense = transition.into_dense();
            e += 1;
            let (end, node) = (dense.end(), &self.nodes[e]);
            motion.record(self.model, end, node);
            motion.keep_element(dense);
        };
        // The same steps succeeded before; if one failed now, the motion would visibly end early.
        let _ = family::TransitionOperator::of_steps(
            self.model,
            self.element,
            self.unfolding,
            steps,
            each,
        );
        motion
    }
}
