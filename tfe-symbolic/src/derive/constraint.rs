//! Constraints: their rows, the derivatives that tangents need, and the kind of each equation.
//!
//! ```text
//! holonomic   φ(q, t) = 0                  A = ∂φ/∂q   a = ∂φ/∂t
//! velocity    ψ = A(q, t) v + a(q, t) = 0
//! ```
//!
//! The velocity v is a leaf of its own in models of both forms. The rate Ȧ = ∂A/∂q v + ∂A/∂t is formed with v as the
//! rate of q, so that ∂Ȧ/∂v = ∂A/∂q, and ∂Ȧ/∂q is the rate of ∂A/∂q: three of the five arrays of second derivatives
//! follow from one.

pub(crate) mod sites;

use crate::derive::entry::Entry;
use crate::derive::structure::deciding;
use crate::expr::constant::Constant;
use crate::expr::differentiate::{Forward, derivative, gradient};
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::{Affine, Input};
use crate::expr::sorting::sort;
use crate::model::declared::{Constraint, ConstraintKind};
use crate::program::{Array, Place};

/// The row A and the drift a of one constraint.
pub(crate) struct Row {
    /// The non-zero entries of A, by coordinate.
    pub(crate) entries: Vec<(Affine, ExprId)>,
    /// a
    pub(crate) drift: ExprId,
}

impl Row {
    /// φ_q and φ_t.
    fn of_positions(graph: &mut Graph, phi: ExprId) -> Self {
        Self {
            entries: slopes(graph, phi, coordinate),
            drift: derivative(graph, phi, &Input::Time),
        }
    }

    /// ∂ψ/∂v, and ψ at v = 0.
    fn of_velocities(graph: &mut Graph, psi: ExprId) -> Self {
        Self {
            entries: slopes(graph, psi, velocity),
            drift: at_rest(graph, psi),
        }
    }

    fn of(graph: &mut Graph, constraint: &Constraint) -> Self {
        match constraint.kind {
            ConstraintKind::Holonomic { .. } => Self::of_positions(graph, constraint.value),
            ConstraintKind::Velocity { .. } => Self::of_velocities(graph, constraint.value),
        }
    }

    /// The places of A and a, for expressions that both hold.
    fn roots(&self) -> Vec<ExprId> {
        let entries = self.entries.iter().map(|(_, value)| *value);
        entries.chain([self.drift]).collect()
    }
}

/// The entries of all constraint arrays.
pub(crate) fn entries(graph: &mut Graph, constraints: &[Constraint]) -> Vec<Entry> {
    let mut collected = Collected::default();
    for (number, constraint) in constraints.iter().enumerate() {
        let row = Row::of(graph, constraint);
        if is_holonomic(constraint) {
            collected.push(graph, Place::scalar(Array::Phi(number)), constraint.value);
        }
        for (column, value) in &row.entries {
            let place = Place::vector(Array::Row(number), column.clone());
            collected.push(graph, place, *value);
        }
        collected.push(graph, Place::scalar(Array::Drift(number)), row.drift);
        collected.rates(graph, number, constraint, &row);
        if is_holonomic(constraint) {
            let mu = graph.input(Input::Multiplier(constraint.row.clone()));
            collected.bends(graph, mu, &row.entries, true);
        }
    }
    collected.contacts(graph, constraints);
    collected.0
}

#[derive(Default)]
struct Collected(Vec<Entry>);

impl Collected {
    fn push(&mut self, graph: &Graph, place: Place, value: ExprId) {
        if !is_zero(graph, value) {
            let nest = Vec::new();
            self.0.push(Entry { nest, place, value });
        }
    }

    /// Ȧ and ∂ψ/∂q, which are equal where ψ is the rate of φ.
    fn rates(&mut self, graph: &mut Graph, number: usize, constraint: &Constraint, row: &Row) {
        let mut along = Forward::default();
        for (column, value) in &row.entries {
            let rate = along.derivative(graph, *value, &mut flow);
            let place = |array| Place::vector(array, column.clone());
            self.push(graph, place(Array::RowRate(number)), rate);
            if is_holonomic(constraint) {
                self.push(graph, place(Array::PsiQ(number)), rate);
            }
        }
        if !is_holonomic(constraint) {
            for (column, slope) in slopes(graph, constraint.value, coordinate) {
                self.push(graph, Place::vector(Array::PsiQ(number), column), slope);
            }
        }
    }

    /// The derivatives of Aᵀμ = ∂(Σ μ ψ)/∂v over all velocity constraints together, because rolling contacts share long
    /// rotations.
    fn contacts(&mut self, graph: &mut Graph, constraints: &[Constraint]) {
        let mut terms = Vec::new();
        for constraint in constraints {
            if !is_holonomic(constraint) {
                let mu = graph.input(Input::Multiplier(constraint.row.clone()));
                terms.push((Constant::ONE, graph.multiply(mu, constraint.value)));
            }
        }
        let weighted = graph.linear(Constant::ZERO, &terms);
        let reaction = slopes(graph, weighted, velocity);
        let one = graph.constant(Constant::ONE);
        self.bends(graph, one, &reaction, false);
    }

    /// ∂(factor G)/∂q = ∂(factor Ġ)/∂v and ∂(factor Ġ)/∂q of a covector G(q, t), whose derivatives may be symmetric.
    fn bends(
        &mut self,
        graph: &mut Graph,
        factor: ExprId,
        covector: &[(Affine, ExprId)],
        symmetric: bool,
    ) {
        let roots: Vec<ExprId> = covector.iter().map(|(_, value)| *value).collect();
        let mut along = Forward::default();
        for (column, leaf) in leaves(graph, &roots, coordinate) {
            let mut by = Forward::default();
            for (at, value) in covector {
                // The other half of a symmetric block is the same expression, and not another expression of equal
                // value.
                if symmetric && *at > column {
                    continue;
                }
                let slope = by_leaf(graph, &mut by, *value, leaf);
                let rate = along.derivative(graph, slope, &mut flow);
                let (bend, rate) = (graph.multiply(factor, slope), graph.multiply(factor, rate));
                for (array, value) in [
                    (Array::Bend, bend),
                    (Array::RateV, bend),
                    (Array::RateQ, rate),
                ] {
                    let (row, column) = (at.clone(), column.clone());
                    let mirrored = (symmetric && row != column).then(|| Place {
                        array,
                        row: column.clone(),
                        column: row.clone(),
                    });
                    self.push(graph, Place { array, row, column }, value);
                    if let Some(place) = mirrored {
                        self.push(graph, place, value);
                    }
                }
            }
        }
    }
}

/// The rate of a leaf at fixed velocities: for a coordinate its velocity, for the time one.
fn flow(graph: &mut Graph, input: &Input) -> Option<ExprId> {
    match input {
        Input::Time => Some(graph.constant(Constant::ONE)),
        Input::Coordinate(at) => Some(graph.input(Input::Velocity(at.clone()))),
        _ => None,
    }
}

fn by_leaf(graph: &mut Graph, forward: &mut Forward, of: ExprId, leaf: ExprId) -> ExprId {
    let one = graph.constant(Constant::ONE);
    let Node::Input(by) = graph.node(leaf).clone() else {
        return graph.constant(Constant::ZERO);
    };
    forward.derivative(graph, of, &mut |_, input| (*input == by).then_some(one))
}

fn is_holonomic(constraint: &Constraint) -> bool {
    matches!(constraint.kind, ConstraintKind::Holonomic { .. })
}

type Pick = fn(&Input) -> Option<&Affine>;

fn coordinate(input: &Input) -> Option<&Affine> {
    match input {
        Input::Coordinate(at) => Some(at),
        _ => None,
    }
}

fn velocity(input: &Input) -> Option<&Affine> {
    match input {
        Input::Velocity(at) => Some(at),
        _ => None,
    }
}

/// The leaves of one kind by their indices, in their order.
fn leaves(graph: &Graph, roots: &[ExprId], pick: Pick) -> Vec<(Affine, ExprId)> {
    let leaf = |id: ExprId| match graph.node(id) {
        Node::Input(input) => pick(input).map(|at| (at.clone(), id)),
        _ => None,
    };
    let mut found: Vec<_> = graph
        .reachable(roots)
        .into_iter()
        .filter_map(leaf)
        .collect();
    sort(&mut found);
    found
}

/// The non-zero first derivatives by all leaves of one kind.
fn slopes(graph: &mut Graph, of: ExprId, pick: Pick) -> Vec<(Affine, ExprId)> {
    let leaves = leaves(graph, &[of], pick);
    let ids: Vec<ExprId> = leaves.iter().map(|(_, leaf)| *leaf).collect();
    let slopes = gradient(graph, of, &ids);
    let indices = leaves.into_iter().map(|(at, _)| at);
    indices
        .zip(slopes)
        .filter(|(_, slope)| !is_zero(graph, *slope))
        .collect()
}

/// The expression with all velocities zero.
fn at_rest(graph: &mut Graph, of: ExprId) -> ExprId {
    graph.with_leaves(of, &mut |graph, input| {
        matches!(input, Input::Velocity(_)).then(|| graph.constant(Constant::ZERO))
    })
}

fn is_zero(graph: &Graph, id: ExprId) -> bool {
    graph.as_constant(id).is_some_and(Constant::is_zero)
}

fn holds(graph: &Graph, id: ExprId, pick: Pick) -> bool {
    !leaves(graph, &[id], pick).is_empty()
}

/// Whether a leaf of this kind decides which branch of an expression is chosen, so that its derivatives do not tell its
/// degree.
fn has_kink_in(graph: &Graph, id: ExprId, pick: Pick) -> bool {
    (graph.reachable(&[id]).into_iter())
        .flat_map(|id| deciding(graph.node(id)))
        .any(|decides| holds(graph, decides, pick))
}

/// Whether an expression depends on velocities.
pub(crate) fn holds_velocity(graph: &Graph, id: ExprId) -> bool {
    holds(graph, id, velocity)
}

/// Whether an expression depends on coordinates or velocities.
pub(crate) fn holds_state(graph: &Graph, id: ExprId) -> bool {
    holds_velocity(graph, id) || holds(graph, id, coordinate)
}

/// Whether an expression is affine in the velocities.
pub(crate) fn is_affine(graph: &mut Graph, id: ExprId) -> bool {
    !has_kink_in(graph, id, velocity)
        && slopes(graph, id, velocity)
            .into_iter()
            .all(|(_, slope)| !holds_velocity(graph, slope))
}

/// The kind of an equation; `None` where it is not affine in the velocities.
pub(crate) fn kind(graph: &mut Graph, value: ExprId) -> Option<ConstraintKind> {
    if !holds_velocity(graph, value) {
        let quadratic = is_quadratic(graph, value);
        return Some(ConstraintKind::Holonomic { quadratic });
    }
    is_affine(graph, value).then(|| {
        let row = Row::of_velocities(graph, value);
        let integrable = is_integrable(graph, &row);
        ConstraintKind::Velocity { integrable }
    })
}

/// Whether φ is found to be a polynomial of at most second degree in the coordinates.
fn is_quadratic(graph: &mut Graph, phi: ExprId) -> bool {
    if has_kink_in(graph, phi, coordinate) {
        return false;
    }
    let first = slopes(graph, phi, coordinate);
    first.into_iter().all(|(_, slope)| {
        let second = slopes(graph, slope, coordinate);
        second
            .into_iter()
            .all(|(_, slope)| !holds(graph, slope, coordinate))
    })
}

/// Whether ∂A_i/∂q_j = ∂A_j/∂q_i and ∂A_i/∂t = ∂a/∂q_i are found to hold; false does not prove the contrary.
fn is_integrable(graph: &mut Graph, row: &Row) -> bool {
    // Where an index is not a number, two leaves may be the same coordinate.
    let known = |at: &Affine| at.as_constant().is_some();
    let leaves = leaves(graph, &row.roots(), coordinate);
    if !row.entries.iter().all(|(at, _)| known(at)) || !leaves.iter().all(|(at, _)| known(at)) {
        return false;
    }
    let entry = |at: &Affine| {
        let found = row.entries.iter().find(|(column, _)| column == at);
        found.map(|(_, value)| *value)
    };
    let mut columns: Vec<Affine> = row.entries.iter().map(|(at, _)| at.clone()).collect();
    columns.extend(leaves.into_iter().map(|(at, _)| at));
    sort(&mut columns);
    columns.dedup();
    let mut slope = |of: Option<ExprId>, by: &Input| match of {
        Some(of) => derivative(graph, of, by),
        None => graph.constant(Constant::ZERO),
    };
    let mut pairs = Vec::new();
    for (number, i) in columns.iter().enumerate() {
        for j in &columns[..number] {
            let one = slope(entry(i), &Input::Coordinate(j.clone()));
            let other = slope(entry(j), &Input::Coordinate(i.clone()));
            pairs.push((one, other));
        }
        let rate = slope(entry(i), &Input::Time);
        let drift = slope(Some(row.drift), &Input::Coordinate(i.clone()));
        pairs.push((rate, drift));
    }
    pairs
        .into_iter()
        .all(|(one, other)| one == other || are_equal(graph, one, other))
}

fn are_equal(graph: &mut Graph, one: ExprId, other: ExprId) -> bool {
    let difference = graph.subtract(one, other);
    let expanded = graph.expanded(difference);
    expanded.is_some_and(|id| is_zero(graph, id))
}

/// The equation without a constant factor: it is the same for two equations that are multiples of each other.
pub(crate) fn normal(graph: &mut Graph, value: ExprId) -> ExprId {
    let value = graph.expanded(value).unwrap_or(value);
    let (_, x) = graph.as_multiple(value);
    let Some((constant, terms)) = graph.as_sum(x).map(|(c, terms)| (c, terms.to_vec())) else {
        return x;
    };
    let Some(factor) = terms.first().and_then(|(first, _)| first.reciprocal()) else {
        return x;
    };
    let scaled: Vec<_> = terms.iter().map(|(c, x)| (*c * factor, *x)).collect();
    let sum = graph.linear(constant * factor, &scaled);
    graph.as_multiple(sum).1
}
