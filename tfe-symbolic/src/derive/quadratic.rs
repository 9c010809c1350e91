//! Energies quadratic in velocities or momenta, by their matrix.
//!
//! ```text
//! E = zᵀ M z / 2 + bᵀ z + U        E_z = M z + b        E_q = zᵀ M_q z / 2 + b_qᵀ z + U_q        M, b, U: of q and t alone
//! ```
//!
//! An energy declared by positions, or by angular velocities about axes that turn, leads to first derivatives that do not share their factors
//! with the second ones: that E_z is E_zz z cannot be seen from the products. Written by M, b and U, all derivatives are made of the same few
//! expressions. Which form costs less is decided where programs are made.

use std::collections::{BTreeMap, BTreeSet};

use crate::derive::entry::{Array, Entry, Place};
use crate::expr::constant::Constant;
use crate::expr::differentiate::gradient;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::input::{Affine, Input};
use crate::expr::rewrite::Mapping;

/// M, b, U and the variables.
struct Parts {
    mass: BTreeMap<(Affine, Affine), ExprId>,
    linear: BTreeMap<Affine, ExprId>,
    rest: ExprId,
    z: BTreeMap<Affine, ExprId>,
}

/// How M, b and U are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Writing {
    /// As they follow from the energy.
    AsDerived,
    /// Multiplied out: squares of sines and cosines meet.
    Expanded,
}

/// The entries with the derivatives of the energy by M, b and U; nothing if it is not quadratic or sums over ranges.
pub(crate) fn entries(
    graph: &mut Graph,
    energy: ExprId,
    entries: &[Entry],
    writing: Writing,
) -> Option<Vec<Entry>> {
    let mut of: BTreeMap<&Place, ExprId> = BTreeMap::new();
    for entry in entries.iter().filter(|entry| is_derivative(&entry.place)) {
        let doubled = of.insert(&entry.place, entry.value).is_some();
        if doubled || !entry.nest.is_empty() {
            return None;
        }
    }
    let parts = Parts::of(graph, energy, &of, writing)?;
    let mut values = parts.derivatives(graph, &of);
    let by_parts = |entry: &Entry| match values.remove(&entry.place) {
        Some(value) => Entry {
            value,
            ..entry.clone()
        },
        None => entry.clone(),
    };
    Some(entries.iter().map(by_parts).collect())
}

/// Derivatives by coordinates: those of an expression by all of them are taken together, once.
struct Slopes {
    indices: Vec<Affine>,
    leaves: Vec<ExprId>,
    known: Map<ExprId, Vec<ExprId>>,
}

impl Slopes {
    fn by(graph: &mut Graph, indices: impl Iterator<Item = Affine>) -> Self {
        let indices: Vec<Affine> = indices.collect();
        let leaf = |index: &Affine| graph.input(Input::Coordinate(index.clone()));
        Self {
            leaves: indices.iter().map(leaf).collect(),
            indices,
            known: Map::default(),
        }
    }

    fn slope(&mut self, graph: &mut Graph, x: ExprId, by: &Affine) -> ExprId {
        let at = self.indices.iter().position(|index| index == by);
        let slopes = self
            .known
            .entry(x)
            .or_insert_with(|| gradient(graph, x, &self.leaves));
        match at.and_then(|at| slopes.get(at)) {
            Some(slope) => *slope,
            None => graph.constant(Constant::ZERO),
        }
    }
}

/// The expression at z = 0.
fn at_rest(graph: &mut Graph, x: ExprId) -> ExprId {
    let mut mapping = Mapping::default();
    for old in graph.reachable(&[x]) {
        let node = graph.node(old).clone();
        let new = if is_z(graph, old) {
            graph.constant(Constant::ZERO)
        } else if node.children().iter().all(|x| mapping.of(*x) == *x) {
            old
        } else {
            graph.remake(&node, &mapping)
        };
        mapping.set(old, new);
    }
    mapping.of(x)
}

/// Whether z stands in sums and products only. Beside |z| or a choice, second derivatives free of z do not make the first ones linear.
fn is_polynomial(graph: &Graph, energy: ExprId) -> bool {
    let mut moving = BTreeSet::new();
    for id in graph.reachable(&[energy]) {
        let moves = |x: &ExprId| moving.contains(x);
        let node = graph.node(id);
        let polynomial = match node {
            Node::Sum { .. } => true,
            Node::Product(factors) => factors.iter().all(|(x, n)| *n > 0 || !moves(x)),
            _ => !node.children().iter().any(moves),
        };
        if !polynomial {
            return false;
        }
        if is_z(graph, id) || node.children().iter().any(moves) {
            moving.insert(id);
        }
    }
    true
}

/// Whether it is a velocity or a momentum.
fn is_z(graph: &Graph, id: ExprId) -> bool {
    matches!(
        graph.node(id),
        Node::Input(Input::Velocity(_) | Input::Momentum(_))
    )
}

/// Whether it is a derivative of the energy.
pub(crate) fn is_derivative(place: &Place) -> bool {
    use Array::{ByQ, ByZ, QQ, ZQ, ZZ};
    matches!(place.array, ByZ | ByQ | ZZ | ZQ | QQ)
}

impl Parts {
    /// The parts of a polynomial of z whose second derivatives are free of z.
    fn of(
        graph: &mut Graph,
        energy: ExprId,
        of: &BTreeMap<&Place, ExprId>,
        writing: Writing,
    ) -> Option<Self> {
        if graph.contains_sum(energy) || !is_polynomial(graph, energy) {
            return None;
        }
        let written = |graph: &mut Graph, x: ExprId| match writing {
            Writing::AsDerived => Some(x),
            Writing::Expanded => graph.expanded(x),
        };
        let mut mass = BTreeMap::new();
        for (place, value) in of.iter().filter(|(place, _)| place.array == Array::ZZ) {
            let value = written(graph, *value)?;
            mass.insert((place.row.clone(), place.column.clone()), value);
        }
        let masses: Vec<ExprId> = mass.values().copied().collect();
        let reachable = graph.reachable(&masses);
        if mass.is_empty() || reachable.into_iter().any(|id| is_z(graph, id)) {
            return None;
        }
        let mut z = BTreeMap::new();
        for id in graph.reachable(&[energy]) {
            if let Node::Input(Input::Velocity(index) | Input::Momentum(index)) = graph.node(id) {
                z.insert(index.clone(), id);
            }
        }
        let mut linear = BTreeMap::new();
        for (place, value) in of.iter().filter(|(place, _)| place.array == Array::ByZ) {
            let b = at_rest(graph, *value);
            linear.insert(place.row.clone(), written(graph, b)?);
        }
        let rest = at_rest(graph, energy);
        let rest = written(graph, rest)?;
        Some(Self {
            mass,
            linear,
            rest,
            z,
        })
    }

    /// The derivatives that are asked for.
    fn derivatives(
        &self,
        graph: &mut Graph,
        of: &BTreeMap<&Place, ExprId>,
    ) -> BTreeMap<Place, ExprId> {
        let by = of.keys().filter(|place| place.array == Array::ByQ);
        let mut slopes = Slopes::by(graph, by.map(|place| place.row.clone()));
        let mut slope = |graph: &mut Graph, x, by: &Affine| slopes.slope(graph, x, by);
        let mut values = BTreeMap::new();
        for place in of.keys() {
            let (row, column) = (&place.row, &place.column);
            let value = match place.array {
                Array::ZZ => self.mass.get(&(row.clone(), column.clone())).copied(),
                Array::ByZ => Some(self.row(graph, row, &mut |_, x| x)),
                Array::ZQ => Some(self.row(graph, row, &mut |graph, x| slope(graph, x, column))),
                Array::ByQ => Some(self.whole(graph, &mut |graph, x| slope(graph, x, row))),
                _ => Some(self.whole(graph, &mut |graph, x| {
                    let first = slope(graph, x, row.max(column));
                    slope(graph, first, row.min(column))
                })),
            };
            if let Some(value) = value {
                values.insert((*place).clone(), value);
            }
        }
        values
    }

    /// Σ M z + b of one row, with M and b differentiated.
    fn row(
        &self,
        graph: &mut Graph,
        row: &Affine,
        slope: &mut dyn FnMut(&mut Graph, ExprId) -> ExprId,
    ) -> ExprId {
        let mut terms = Vec::new();
        for ((_, column), m) in self.mass.iter().filter(|((known, _), _)| known == row) {
            if let Some(z) = self.z.get(column) {
                let slope = slope(graph, *m);
                terms.push((Constant::ONE, graph.multiply(slope, *z)));
            }
        }
        if let Some(b) = self.linear.get(row) {
            terms.push((Constant::ONE, slope(graph, *b)));
        }
        graph.linear(Constant::ZERO, &terms)
    }

    /// Σ M z z / 2 + Σ b z + U, with M, b and U differentiated; entries of M off the diagonal stand twice.
    fn whole(
        &self,
        graph: &mut Graph,
        slope: &mut dyn FnMut(&mut Graph, ExprId) -> ExprId,
    ) -> ExprId {
        let half = Constant::rational(1, 2).unwrap_or(Constant::ONE);
        let mut terms = vec![(Constant::ONE, slope(graph, self.rest))];
        for ((row, column), m) in self.mass.iter().filter(|((row, column), _)| row <= column) {
            if let (Some(a), Some(b)) = (self.z.get(row), self.z.get(column)) {
                let factor = if row == column { half } else { Constant::ONE };
                let both = graph.multiply(*a, *b);
                let slope = slope(graph, *m);
                terms.push((factor, graph.multiply(slope, both)));
            }
        }
        for (row, b) in &self.linear {
            if let Some(z) = self.z.get(row) {
                let slope = slope(graph, *b);
                terms.push((Constant::ONE, graph.multiply(slope, *z)));
            }
        }
        graph.linear(Constant::ZERO, &terms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::declare;
    use crate::syntax::context::Context;

    fn polynomial(energy: &str) -> bool {
        let text = format!("coordinates(x, y), lagrangian = dot(y)^2/2 + {energy}");
        let declared = declare(&text, &Context::default()).expect("a model of the test");
        is_polynomial(&declared.graph, declared.energy)
    }

    #[test]
    fn velocities_in_functions_are_no_polynomials() {
        assert!(polynomial("cos(x)*dot(x)^2 + t*dot(x)"));
        assert!(polynomial("(x*dot(x) + sin(y)*dot(y))^2/(1 + x^2)"));
        assert!(!polynomial("dot(x)^2 + abs(dot(x))*y"));
        assert!(!polynomial("dot(x)^2/(1 + dot(y)^2)"));
        assert!(!polynomial("dot(x)^2 + sqrt(1 - dot(y)^2)"));
    }

    /// All derivatives of an energy of two coordinates.
    fn derivatives(graph: &mut Graph, energy: ExprId) -> Vec<Entry> {
        let index = Affine::constant;
        let z = [0, 1].map(|k| graph.input(Input::Velocity(index(k))));
        let q = [0, 1].map(|k| graph.input(Input::Coordinate(index(k))));
        let leaves = [z, q].concat();
        let mut all = Vec::new();
        let mut push = |array, row, column, value| {
            all.push(Entry {
                nest: Vec::new(),
                place: Place { array, row, column },
                value,
            });
        };
        let slopes = gradient(graph, energy, &leaves);
        for (a, slope) in slopes.into_iter().enumerate() {
            let row = index(a as i64 % 2);
            let array = if a < 2 { Array::ByZ } else { Array::ByQ };
            push(array, row.clone(), Affine::default(), slope);
            for (b, value) in gradient(graph, slope, &leaves).into_iter().enumerate() {
                let column = index(b as i64 % 2);
                let array = match (a < 2, b < 2) {
                    (true, true) => Array::ZZ,
                    (true, false) => Array::ZQ,
                    (false, true) => continue,
                    (false, false) => Array::QQ,
                };
                push(array, row.clone(), column, value);
            }
        }
        all
    }

    #[test]
    fn the_parts_give_the_same_derivatives() {
        // With terms linear in velocities and terms free of them.
        let text = "coordinates(x, y), lagrangian = (dot(x) + t*y)^2/2 + (dot(y) - x)^2*(1 + x^2)/2 + x*y*dot(x)*dot(y) - x^4*y";
        let mut declared = declare(text, &Context::default()).expect("a model of the test");
        let (graph, energy) = (&mut declared.graph, declared.energy);
        let all = derivatives(graph, energy);
        for writing in [Writing::AsDerived, Writing::Expanded] {
            let written = entries(graph, energy, &all, writing).expect("it is quadratic");
            assert_eq!(written.len(), all.len());
            for (entry, own) in written.iter().zip(&all) {
                let difference = graph.subtract(entry.value, own.value);
                let difference = graph.expanded(difference).expect("few terms");
                let zero = graph.as_constant(difference).is_some_and(Constant::is_zero);
                assert!(zero, "{:?}: {}", own.place, graph.display(difference));
            }
        }
    }
}
