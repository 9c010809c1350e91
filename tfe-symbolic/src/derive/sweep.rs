//! The direction in which the chain rule is applied: forward or backward.

use crate::expr::constant::Constant;
use crate::expr::differentiate::{Forward, gradient};
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;

/// A direction of the chain rule.
///
/// ```text
/// T = m (x² + y²)/2, x = l φ̇ cos φ, y = l φ̇ sin φ        ∂T/∂φ = m (x ∂x/∂φ + y ∂y/∂φ) = m (y x − x y) = 0
/// ```
///
/// Forward, terms that cancel are combined as a person would write them. Backward, each sine has a sum of terms of its
/// own, in which they are not combined: this takes fewer operations where nothing cancels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sweep {
    Forward,
    Backward,
}

/// If the number of expressions in an energy times that of its inputs is larger, it is differentiated backward only:
/// forward, each input has derivatives of all expressions, and second derivatives have those of all these. The models
/// of `benches/kernels` are below this limit; the largest, six planets, has 2739.
const MAX_FORWARD: usize = 4000;

impl Sweep {
    /// Forward, unless the energy is too large for it.
    pub(crate) fn of(graph: &Graph, energy: ExprId) -> Self {
        let nodes = graph.reachable(&[energy]);
        let is_leaf = |id: &&ExprId| matches!(graph.node(**id), Node::Input(_));
        let leaves = nodes.iter().filter(is_leaf).count();
        match nodes.len().saturating_mul(leaves) <= MAX_FORWARD {
            true => Self::Forward,
            false => Self::Backward,
        }
    }

    /// The derivatives of a body without sums over ranges by inputs.
    pub(crate) fn slopes(self, graph: &mut Graph, body: ExprId, leaves: &[ExprId]) -> Vec<ExprId> {
        match self {
            Self::Backward => gradient(graph, body, leaves),
            Self::Forward => {
                let by = leaves.iter();
                by.map(|leaf| along(&mut Forward::default(), graph, body, *leaf))
                    .collect()
            }
        }
    }
}

/// The forward derivative by one input; `known` must belong to the same input.
pub(crate) fn along(known: &mut Forward, graph: &mut Graph, of: ExprId, leaf: ExprId) -> ExprId {
    let one = graph.constant(Constant::ONE);
    let by = graph.node(leaf).clone();
    let seed = &mut |_: &mut Graph, input: &Input| {
        matches!(&by, Node::Input(own) if own == input).then_some(one)
    };
    known.derivative(graph, of, seed)
}
