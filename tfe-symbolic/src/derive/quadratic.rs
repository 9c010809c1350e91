//! Energies that are quadratic in velocities or momenta, in terms of their matrix.
//!
//! ```text
//! E = uᵀ M u / 2 + bᵀ u + U        u = A z        M, b, U: of q and t alone        A: numbers
//! E_u = M u + b        E_z = Aᵀ E_u        E_zz = Aᵀ M A        E_q = uᵀ M_q u / 2 + b_qᵀ u + U_q
//! ```
//!
//! For an energy declared by positions, or by angular velocities about moving axes, the first derivatives do not share
//! factors with the second ones: from the products alone it cannot be seen that E_z is E_zz z. In terms of M, b and U,
//! all derivatives consist of the same few expressions. Which form is cheaper is decided when programs are made.
//!
//! The *rates* u are z, or z and the sums of velocities that appear in the energy: in m (v₁ + v₂)²/2, m v₁ + m v₂ would
//! lose the digits that v₁ + v₂ has where both are nearly opposite.

use crate::derive::entry::Entry;
use crate::derive::sweep::Sweep;
use crate::expr::constant::Constant;
use crate::expr::differentiate::gradient;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::input::{Affine, Input};
use crate::expr::ordered::{SortedMap, SortedSet};
use crate::expr::rewrite::Mapping;
use crate::expr::sorting::sort;
use crate::optimise::estimate::{estimate, is_worth_following};
use crate::program::{Array, Place};

/// A variable in which the energy is quadratic: a velocity or momentum, or a sum of them.
#[derive(Clone)]
struct Rate {
    value: ExprId,
    /// The leaf that represents it while derivatives are taken.
    leaf: ExprId,
    /// ∂value/∂z
    shares: SortedMap<Affine, Constant>,
}

/// M, b, U and u.
struct Parts {
    rates: Vec<Rate>,
    /// The non-zero entries of the upper triangle.
    mass: SortedMap<(usize, usize), ExprId>,
    linear: Vec<ExprId>,
    rest: ExprId,
}

/// Entries of M, b and U are multiplied out to at most this number of terms.
const MAX_TERMS: usize = 64;

/// How M, b and U are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Writing {
    /// As they follow from the energy.
    AsDerived,
    /// Multiplied out, so that squares of sines and cosines combine.
    Expanded,
}

/// The derivatives of the energy by M, b and U, to replace those among the entries, in the ways that may be cheaper;
/// none if the energy is not quadratic or sums over ranges.
pub(crate) fn entries(graph: &mut Graph, energy: ExprId, entries: &[Entry]) -> Vec<Vec<Entry>> {
    let mut places: SortedSet<&Place> = SortedSet::new();
    for entry in entries.iter().filter(|entry| is_derivative(&entry.place)) {
        if !places.insert(&entry.place) || !entry.nest.is_empty() {
            return Vec::new();
        }
    }
    if graph.contains_sum(energy) || !is_polynomial(graph, energy) {
        return Vec::new();
    }
    let is_first = |place: &&Place| matches!(place.array, Array::ByZ | Array::ByQ);
    let first = |entry: &&Entry| is_first(&&entry.place);
    let declared: Vec<ExprId> = entries
        .iter()
        .filter(first)
        .map(|entry| entry.value)
        .collect();
    let declared = estimate(graph, &declared);
    let (firsts, seconds): (SortedSet<&Place>, SortedSet<&Place>) =
        places.into_iter().partition(is_first);
    let velocities = velocities(graph, energy);
    let sums = sums_of_velocities(graph, energy);
    let mut rates = vec![velocities];
    if !sums.is_empty() {
        rates.push(rates[0].iter().cloned().chain(sums).collect());
    }
    let mut found: Vec<Vec<Entry>> = Vec::new();
    for rates in rates {
        let Some(derived) = Parts::of(graph, energy, rates) else {
            return found;
        };
        for writing in [Writing::AsDerived, Writing::Expanded] {
            let Some(parts) = derived.written(graph, writing) else {
                continue;
            };
            let mut slopes = Slopes::by(graph, &firsts);
            let mut values = parts.derivatives(graph, &firsts, &mut slopes);
            let values_of_first: Vec<ExprId> = values.values().copied().collect();
            if !is_worth_following(estimate(graph, &values_of_first), declared) {
                continue;
            }
            values.extend(parts.derivatives(graph, &seconds, &mut slopes));
            let by_parts = |entry: &Entry| Entry {
                value: values.get(&entry.place).copied().unwrap_or(entry.value),
                ..entry.clone()
            };
            found.push(entries.iter().map(by_parts).collect());
        }
    }
    found
}

/// The velocities, or momenta, in an energy.
fn velocities(graph: &Graph, energy: ExprId) -> Vec<Rate> {
    let nodes = graph.reachable(&[energy]).into_iter();
    let mut found: Vec<(Affine, ExprId)> = nodes
        .filter_map(|id| Some((velocity(graph, id)?.clone(), id)))
        .collect();
    sort(&mut found);
    let rate = |(index, id)| Rate {
        value: id,
        leaf: id,
        shares: SortedMap::from([(index, Constant::ONE)]),
    };
    found.into_iter().map(rate).collect()
}

/// The sums of velocities, or of momenta, in an energy, each with a leaf that represents it.
fn sums_of_velocities(graph: &mut Graph, energy: ExprId) -> Vec<Rate> {
    let mut found: Vec<(ExprId, SortedMap<Affine, Constant>)> = Vec::new();
    for id in graph.reachable(&[energy]) {
        let Some((constant, terms)) = graph.as_sum(id).filter(|(_, terms)| terms.len() > 1) else {
            continue;
        };
        let share = |(c, x): &(Constant, ExprId)| Some((velocity(graph, *x)?.clone(), *c));
        let shares: Option<SortedMap<Affine, Constant>> = terms.iter().map(share).collect();
        if let Some(shares) = shares.filter(|_| constant.is_zero()) {
            found.push((id, shares));
        }
    }
    let rate = |(number, (value, shares)): (usize, (ExprId, SortedMap<Affine, Constant>))| {
        let place = Affine::constant(number as i64);
        Rate {
            value,
            leaf: graph.input(Input::Placeholder(RATES, place)),
            shares,
        }
    };
    found.into_iter().enumerate().map(rate).collect()
}

/// The list of the placeholders of sums of velocities.
const RATES: u32 = 0;

/// The index of a velocity or a momentum.
fn velocity(graph: &Graph, id: ExprId) -> Option<&Affine> {
    match graph.node(id) {
        Node::Input(Input::Velocity(index) | Input::Momentum(index)) => Some(index),
        _ => None,
    }
}

/// Derivatives by coordinates: those of an expression by all of them are taken together, once.
struct Slopes {
    indices: Vec<Affine>,
    leaves: Vec<ExprId>,
    known: Map<ExprId, Vec<ExprId>>,
}

impl Slopes {
    fn by(graph: &mut Graph, places: &SortedSet<&Place>) -> Self {
        let by_q = places.iter().filter(|place| place.array == Array::ByQ);
        let indices: Vec<Affine> = by_q.map(|place| place.row.clone()).collect();
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

/// The expression at u = 0.
fn at_rest(graph: &mut Graph, x: ExprId) -> ExprId {
    graph.with_leaves(x, &mut |graph, input| {
        matches!(
            input,
            Input::Velocity(_) | Input::Momentum(_) | Input::Placeholder(RATES, _)
        )
        .then(|| graph.constant(Constant::ZERO))
    })
}

/// Whether z appears in sums and products only. With |z| or a choice, second derivatives that do not depend on z do not
/// make the first ones linear.
fn is_polynomial(graph: &Graph, energy: ExprId) -> bool {
    let mut moving = SortedSet::new();
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
        if velocity(graph, id).is_some() || node.children().iter().any(moves) {
            moving.insert(id);
        }
    }
    true
}

/// Whether it is a derivative of the energy.
pub(crate) fn is_derivative(place: &Place) -> bool {
    use Array::{ByQ, ByZ, QQ, ZQ, ZZ};
    matches!(place.array, ByZ | ByQ | ZZ | ZQ | QQ)
}

impl Parts {
    /// The parts of a polynomial of the rates, if its second derivatives do not depend on them.
    fn of(graph: &mut Graph, energy: ExprId, rates: Vec<Rate>) -> Option<Self> {
        let sweep = Sweep::of(graph, energy);
        let energy = with_leaves_for(graph, energy, &rates);
        let leaves: Vec<ExprId> = rates.iter().map(|rate| rate.leaf).collect();
        let slopes = sweep.slopes(graph, energy, &leaves);
        let mut mass = SortedMap::new();
        for (row, slope) in slopes.iter().enumerate() {
            for (at, value) in sweep
                .slopes(graph, *slope, &leaves[row..])
                .into_iter()
                .enumerate()
            {
                if !is_zero(graph, value) {
                    mass.insert((row, row + at), value);
                }
            }
        }
        let masses: Vec<ExprId> = mass.values().copied().collect();
        let reachable = graph.reachable(&masses);
        if mass.is_empty() || reachable.iter().any(|id| leaves.contains(id)) {
            return None;
        }
        let linear = slopes.into_iter().map(|slope| at_rest(graph, slope));
        let linear = linear.collect();
        let rest = at_rest(graph, energy);
        Some(Self {
            rates,
            mass,
            linear,
            rest,
        })
    }

    /// The same, written in another way.
    fn written(&self, graph: &mut Graph, writing: Writing) -> Option<Self> {
        let mut written = |x: ExprId| match writing {
            Writing::AsDerived => Some(x),
            Writing::Expanded => graph.expanded_within(x, MAX_TERMS),
        };
        let mass = self.mass.iter().map(|(at, x)| Some((*at, written(*x)?)));
        Some(Self {
            mass: mass.collect::<Option<_>>()?,
            linear: self
                .linear
                .iter()
                .map(|x| written(*x))
                .collect::<Option<_>>()?,
            rest: written(self.rest)?,
            rates: self.rates.clone(),
        })
    }

    /// The requested derivatives.
    fn derivatives(
        &self,
        graph: &mut Graph,
        places: &SortedSet<&Place>,
        slopes: &mut Slopes,
    ) -> SortedMap<Place, ExprId> {
        let mut slope = |graph: &mut Graph, x, by: &Affine| slopes.slope(graph, x, by);
        let mut values = SortedMap::new();
        for place in places {
            let (row, column) = (&place.row, &place.column);
            let value = match place.array {
                Array::ZZ => self.matrix(graph, row, column),
                Array::ByZ => self.row(graph, row, &mut |_, x| x),
                Array::ZQ => self.row(graph, row, &mut |graph, x| slope(graph, x, column)),
                Array::ByQ => self.whole(graph, &mut |graph, x| slope(graph, x, row)),
                _ => self.whole(graph, &mut |graph, x| {
                    let first = slope(graph, x, row.max(column));
                    slope(graph, first, row.min(column))
                }),
            };
            values.insert((*place).clone(), value);
        }
        values
    }

    /// Aᵀ M A at one place.
    fn matrix(&self, graph: &mut Graph, row: &Affine, column: &Affine) -> ExprId {
        let mut terms = Vec::new();
        for (k, l, m) in self.both_triangles() {
            let shares = (
                self.rates[k].shares.get(row),
                self.rates[l].shares.get(column),
            );
            if let (Some(a), Some(b)) = shares {
                terms.push((*a * *b, m));
            }
        }
        graph.linear(Constant::ZERO, &terms)
    }

    /// Aᵀ (M u + b) of one row, with M and b differentiated.
    fn row(
        &self,
        graph: &mut Graph,
        row: &Affine,
        slope: &mut dyn FnMut(&mut Graph, ExprId) -> ExprId,
    ) -> ExprId {
        let mut terms = Vec::new();
        for (k, l, m) in self.both_triangles() {
            if let Some(share) = self.rates[k].shares.get(row) {
                let slope = slope(graph, m);
                terms.push((*share, graph.multiply(slope, self.rates[l].value)));
            }
        }
        for (rate, b) in self.rates.iter().zip(&self.linear) {
            if let Some(share) = rate.shares.get(row) {
                terms.push((*share, slope(graph, *b)));
            }
        }
        graph.linear(Constant::ZERO, &terms)
    }

    /// uᵀ M u / 2 + bᵀ u + U, with M, b and U differentiated; entries of M off the diagonal stand twice.
    fn whole(
        &self,
        graph: &mut Graph,
        slope: &mut dyn FnMut(&mut Graph, ExprId) -> ExprId,
    ) -> ExprId {
        let half = Constant::rational(1, 2).unwrap_or(Constant::ONE);
        let mut terms = vec![(Constant::ONE, slope(graph, self.rest))];
        for ((row, column), m) in &self.mass {
            let factor = if row == column { half } else { Constant::ONE };
            let both = graph.multiply(self.rates[*row].value, self.rates[*column].value);
            let slope = slope(graph, *m);
            terms.push((factor, graph.multiply(slope, both)));
        }
        for (rate, b) in self.rates.iter().zip(&self.linear) {
            let slope = slope(graph, *b);
            terms.push((Constant::ONE, graph.multiply(slope, rate.value)));
        }
        graph.linear(Constant::ZERO, &terms)
    }

    /// The entries of M with their rows and columns.
    fn both_triangles(&self) -> impl Iterator<Item = (usize, usize, ExprId)> {
        self.mass.iter().flat_map(|((row, column), m)| {
            let mirrored = (row != column).then_some((*column, *row, *m));
            [(*row, *column, *m)].into_iter().chain(mirrored)
        })
    }
}

fn is_zero(graph: &Graph, x: ExprId) -> bool {
    graph.as_constant(x).is_some_and(Constant::is_zero)
}

/// The energy with the leaves of rates in place of their values.
fn with_leaves_for(graph: &mut Graph, energy: ExprId, rates: &[Rate]) -> ExprId {
    let mut mapping = Mapping::default();
    for rate in rates {
        mapping.set(rate.value, rate.leaf);
    }
    for old in graph.reachable(&[energy]) {
        if mapping.of(old) != old {
            continue;
        }
        if !mapping.keeps(graph.node(old)) {
            let node = graph.node(old).clone();
            let new = graph.remake(&node, &mapping);
            mapping.set(old, new);
        }
    }
    mapping.of(energy)
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

    /// In how many ways derivatives are written, all of them equal to those of the energy.
    fn ways(text: &str) -> usize {
        let mut declared = declare(text, &Context::default()).expect("a model of the test");
        let (graph, energy) = (&mut declared.graph, declared.energy);
        let all = derivatives(graph, energy);
        let ways = entries(graph, energy, &all);
        for written in &ways {
            assert_eq!(written.len(), all.len());
            for (entry, own) in written.iter().zip(&all) {
                let difference = graph.subtract(entry.value, own.value);
                let difference = graph.expanded(difference).expect("few terms");
                assert!(
                    is_zero(graph, difference),
                    "{:?}: {}",
                    own.place,
                    graph.display(difference)
                );
            }
        }
        ways.len()
    }

    #[test]
    fn the_parts_give_the_same_derivatives() {
        // With terms linear in velocities and terms free of them.
        let text = "coordinates(x, y), lagrangian = (dot(x) + t*y)^2/2 + (dot(y) - x)^2*(1 + x^2)/2 + x*y*dot(x)*dot(y) - x^4*y";
        assert!(ways(text) > 0);
    }

    #[test]
    fn sums_of_velocities_are_rates() {
        let text = "coordinates(x, y), lagrangian = dot(x)^2*(1 + x^2)/2 + (dot(x) + 2*dot(y))^2*(3 + y^2)/2 + x*(dot(x) + 2*dot(y))";
        assert!(ways(text) > 0);
        let mut declared = declare(text, &Context::default()).expect("a model of the test");
        let (graph, energy) = (&mut declared.graph, declared.energy);
        let sums = sums_of_velocities(graph, energy);
        let all = derivatives(graph, energy);
        let ways = entries(graph, energy, &all);
        let keeps_the_sum = |entry: &Entry| {
            entry.place.array == Array::ByZ
                && graph.reachable(&[entry.value]).contains(&sums[0].value)
        };
        assert!(ways.iter().any(|way| way.iter().any(keeps_the_sum)));
    }

    #[test]
    fn long_ways_are_not_followed() {
        assert_eq!(
            ways("coordinates(x, y), lagrangian = (1 + x + y)^9*(dot(x) + (2 + x*y)^5*dot(y))^2"),
            0
        );
    }
}
