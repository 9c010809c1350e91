//! Derivatives of entries by a parameter or by the time.
//!
//! An element `k[2]` may also appear as `k[i]` in the body of a loop. There the derivative counts only where both are
//! the same element,
//!
//! ```text
//! ∂/∂k[2] Σᵢ f(k[i]) = Σᵢ { f′(k[i])  where i − 2 = 0;  0  elsewhere }
//! ```
//!
//! written as a choice and not as a product with zero or one, so that other elements at which f′ is infinite do no
//! harm.

use crate::derive::entry::Entry;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::differentiate::gradient;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::{Affine, Input};
use crate::model::declared::Parameter;
use crate::program::Array;

/// The variable by which derivatives are taken.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Leaf<'a> {
    Time,
    Parameter(&'a Parameter),
}

impl Leaf<'_> {
    /// The difference of the index of an input and that of this leaf; `None` if they can never be the same.
    fn distance(self, input: &Input) -> Option<Affine> {
        match (self, input) {
            (Self::Time, Input::Time) => Some(Affine::default()),
            (Self::Parameter(parameter), Input::Parameter(name)) => {
                (*name == parameter.field).then(Affine::default)
            }
            (Self::Parameter(parameter), Input::ParameterElement(name, index)) => {
                let element = i64::try_from(parameter.element?).ok()?;
                let distance = index.plus_scaled(&Affine::constant(element), -1)?;
                let apart = distance.as_constant().is_some_and(|distance| distance != 0);
                (*name == parameter.field && !apart).then_some(distance)
            }
            _ => None,
        }
    }
}

/// The non-zero derivatives of the first derivatives and forces among `entries`.
pub(crate) fn entries_by(graph: &mut Graph, entries: &[Entry], leaf: Leaf<'_>) -> Vec<Entry> {
    let first =
        |entry: &&Entry| matches!(entry.place.array, Array::ByZ | Array::ByQ | Array::Force);
    let mut derivatives = Vec::new();
    for entry in entries.iter().filter(first) {
        let value = derivative(graph, entry.value, leaf);
        if !graph.as_constant(value).is_some_and(Constant::is_zero) {
            let (nest, place) = (entry.nest.clone(), entry.place.clone());
            derivatives.push(Entry { nest, place, value });
        }
    }
    derivatives
}

/// ∂/∂leaf. Recursion is as deep as sums over ranges nest.
fn derivative(graph: &mut Graph, of: ExprId, leaf: Leaf<'_>) -> ExprId {
    let (mut leaves, mut sums) = (Vec::new(), Vec::new());
    for id in graph.reachable_outside_sums(&[of]) {
        match graph.node(id) {
            Node::Input(input) => leaves.extend(leaf.distance(input).map(|far| (id, far))),
            Node::Loop { range, body } => sums.push((id, range.clone(), *body)),
            _ => {}
        }
    }
    let by: Vec<ExprId> = leaves
        .iter()
        .map(|(id, _)| *id)
        .chain(sums.iter().map(|(id, ..)| *id))
        .collect();
    let slopes = gradient(graph, of, &by);
    let (direct, through) = slopes.split_at(leaves.len());
    let mut terms = Vec::with_capacity(by.len());
    for ((_, distance), slope) in leaves.into_iter().zip(direct) {
        terms.push((Constant::ONE, where_zero(graph, distance, *slope)));
    }
    for ((_, range, body), slope) in sums.into_iter().zip(through) {
        let body = derivative(graph, body, leaf);
        let sum = graph.sum(range, body);
        terms.push((Constant::ONE, graph.multiply(*slope, sum)));
    }
    graph.linear(Constant::ZERO, &terms)
}

/// `value` where the distance is zero, zero elsewhere.
fn where_zero(graph: &mut Graph, distance: Affine, value: ExprId) -> ExprId {
    if distance.as_constant() == Some(0) {
        return value;
    }
    let zero = graph.constant(Constant::ZERO);
    let distance = graph.input(Input::Integer(distance));
    let square = graph.multiply(distance, distance);
    graph.select(Comparison::LessOrEqual, square, zero, value, zero)
}
