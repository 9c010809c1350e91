//! Compares an optimum with one on elements of half the length, by one correction.

use super::problem::{Iterate, Problem};
use super::{Curve, OptimalControl, Optimum};
use crate::assembly::{HalvedCorrection, MeshWarning};
use nalgebra::DVector;
use tfe_runtime::Controlled;
use tfe_runtime::scheme::SchemeTable;

impl<M: Controlled<N>, const N: usize> OptimalControl<'_, M, N> {
    /// The warnings for an optimum, by one correction of its motion on elements of half the length (`fine`). If there is
    /// no correction, there are none.
    pub(super) fn doubts(
        &self,
        table: &SchemeTable,
        (fine, places): (&Problem<'_>, &[(f64, f64)]),
        optimum: &Optimum<N>,
    ) -> Vec<MeshWarning> {
        let motion = &optimum.motion;
        let node = |t: f64| motion.at(t).unwrap_or(*motion.last());
        let curve: Curve<'_, N> = Box::new(|t| (node(t).q, node(t).v));
        let input = |half: usize, input: usize, t: f64| optimum.pieces.at(half / 2, input, t);
        let Ok(mut iterate) = self.first(table, fine, places, (&curve, &input)) else {
            return Vec::new();
        };
        let times = places.iter().map(|(t, _)| *t).chain([self.span.end]);
        for (own, t) in iterate.nodes.iter_mut().zip(times) {
            let node = node(t);
            *own = DVector::from_vec([node.p, node.q].concat());
        }
        let Some((whole, change)) = fine.correction_without_multipliers(&mut iterate) else {
            return Vec::new();
        };
        let nodes = iterate.nodes.iter().zip(&change.nodes);
        let nodes = nodes.map(|(node, change)| {
            let (p, q) = node.as_slice().split_at(N);
            (p, q, change.as_slice())
        });
        let nodes: Vec<_> = nodes.collect();
        HalvedCorrection::of(whole, &nodes, []).doubts(self.elements)
    }
}

impl Problem<'_> {
    /// The correction of an iterate near a minimum, whose multipliers are not known yet, with its size relative to the
    /// iterate.
    fn correction_without_multipliers(&self, iterate: &mut Iterate) -> Option<(f64, Iterate)> {
        let mut chain = self.chain();
        let condensed = self.linearise(iterate).ok()?;
        // Near a minimum, the multipliers hardly depend on the curvature of the quadratic model.
        let convex = (0.0, self.scale(&condensed));
        let first = self.step(&mut chain, &condensed, iterate, convex)?.change;
        let known = iterate.multipliers.iter_mut().chain(&mut iterate.costates);
        for (own, change) in known.zip(first.multipliers.iter().chain(&first.costates)) {
            *own += change;
        }
        let condensed = self.linearise(iterate).ok()?;
        let step = self.step(&mut chain, &condensed, iterate, (1.0, 0.0))?;
        Some((self.size(&step, &condensed, iterate), step.change))
    }
}
