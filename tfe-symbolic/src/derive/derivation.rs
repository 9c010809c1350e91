//! From a declared model to the entries of its kernels: the place of each derivative, and the loops around it.
//!
//! The energy is split into terms, each a nest of ranges around a body. A body is differentiated once by its *slots*, the distinct leaves
//! such as `q[i]` and `q[i+1]`. A first derivative by the slot `q[a]` adds to entry a, a second one by two slots adds to (a, b) and to (b, a):
//! this holds also where both indices happen to be equal.
//!
//! A function of sums, such as `sqrt(sum(i in 0..n, q[i]^2))`, couples all coordinates. There each inner sum S counts
//! as a further leaf of the body, and the chain rule continues into it: ∂f/∂q = (∂f/∂S)(∂S/∂q), in one more loop.

use std::cell::RefCell;

use crate::derive::constraint;
use crate::derive::entry::Entry;
use crate::derive::limits::take_limits;
use crate::derive::quadratic;
use crate::derive::structure::Structure;
use crate::derive::sweep::{Sweep, along};
use crate::expr::constant::Constant;
use crate::expr::differentiate::{Forward, gradient};
use crate::expr::graph::{ExprId, Graph, Node, SumRange};
use crate::expr::hash::Map;
use crate::expr::input::{Affine, IndexSymbol, Input, LoopVariable};
use crate::expr::ordered::{SortedMap, SortedSet};
use crate::expr::sorting::sort;
use crate::model::declared::{Constraint, Declared, Force, Form, Observable, Parameter};
use crate::optimise::passes::{Pass, Passes};
use crate::program::{Array, Place, Program, Request};

/// What is differentiated.
#[derive(Clone, Debug)]
pub struct Model {
    /// Lagrangian or Hamiltonian.
    pub form: Form,
    /// The number of coordinates.
    pub dof: Affine,
    /// The expressions.
    pub graph: Graph,
    /// L or H.
    pub energy: ExprId,
    /// The Rayleigh function D(v, q) of a Lagrangian model; Q = −∂D/∂v.
    pub dissipation: Option<ExprId>,
    /// The generalized forces.
    pub forces: Vec<Force>,
    /// The constraints, free of sums over ranges; those by site of models of run-time length are holonomic.
    pub constraints: Vec<Constraint>,
    /// The observables.
    pub observables: Vec<Observable>,
    /// The parameters by which derivatives are wanted.
    pub sensitivities: Vec<Parameter>,
}

impl From<&Declared> for Model {
    fn from(declared: &Declared) -> Self {
        Self {
            form: declared.form,
            dof: declared.dof.clone(),
            graph: declared.graph.clone(),
            energy: declared.energy,
            dissipation: declared.dissipation,
            forces: declared.forces.clone(),
            constraints: declared.constraints.clone(),
            observables: declared.observables.clone(),
            sensitivities: declared.sensitivities.clone(),
        }
    }
}

/// All derivatives of a model.
///
/// ```
/// use tfe_symbolic::compile::declare;
/// use tfe_symbolic::syntax::context::Context;
/// use tfe_symbolic::derive::derivation::Derivation;
/// use tfe_symbolic::program::Request;
///
/// let text = "coordinates(a), lagrangian = dot(a)^2/2 + 9.81*cos(a)";
/// let declared = declare(text, &Context::default()).expect("no mistakes in it");
/// let derivation = Derivation::of(&declared);
/// let first = derivation.program(Request { first: true, ..Request::default() });
/// assert_eq!(
///     first.to_string(),
///     "t0 = sin(q[0])\n\
///      E_z[0] = v[0]\n\
///      t1 = 9.81 * t0\n\
///      t2 = -t1\n\
///      E_q[0] = t2\n"
/// );
/// assert!(derivation.structure().separable);
/// ```
#[derive(Clone, Debug)]
pub struct Derivation {
    pub(crate) graph: Graph,
    pub(crate) entries: Vec<Entry>,
    /// The same entries derived in other ways: by the chain rule backward, by the matrix of an energy that is quadratic
    /// in z.
    pub(crate) written: Vec<Vec<Entry>>,
    structure: Structure,
    pub(crate) sensitivities: Vec<Parameter>,
    pub(crate) passes: Passes,
    /// The programs requested so far: each is optimised only once, which takes most of the time of an expansion.
    pub(crate) programs: RefCell<Map<Request, Program>>,
}

impl Derivation {
    /// Differentiates a declared model.
    pub fn of(declared: &Declared) -> Self {
        Self::of_model(Model::from(declared))
    }

    /// The same, with programs made without one of the passes, to measure its effect.
    pub fn without(declared: &Declared, pass: Pass) -> Self {
        Self::by_passes(Model::from(declared), Passes::without(pass))
    }

    /// Differentiates a model.
    pub fn of_model(model: Model) -> Self {
        Self::by_passes(model, Passes::ALL)
    }

    fn by_passes(model: Model, passes: Passes) -> Self {
        let Model {
            form,
            dof,
            mut graph,
            energy,
            dissipation,
            forces,
            constraints,
            observables,
            sensitivities,
        } = model;
        graph.ranges_are_checked = dof.is_of_run_time();
        let mut deriver = Deriver {
            form,
            sweep: Sweep::of(&graph, energy),
            graph: &mut graph,
            entries: Vec::new(),
        };
        deriver.energy(energy);
        let others = deriver.entries.len();
        if let Some(dissipation) = dissipation {
            deriver.dissipation(dissipation);
        }
        for force in &forces {
            deriver.force(force.ranges.clone(), force.target.clone(), force.value);
        }
        deriver.observables(&observables);
        let mut entries = deriver.entries;
        let constrain = match dof.is_of_run_time() {
            true => constraint::sites::entries,
            false => constraint::entries,
        };
        entries.extend(constrain(&mut graph, &constraints));
        let mut written: Vec<Vec<Entry>> = Vec::new();
        if Sweep::of(&graph, energy) == Sweep::Forward {
            let mut deriver = Deriver {
                form,
                sweep: Sweep::Backward,
                graph: &mut graph,
                entries: Vec::new(),
            };
            deriver.energy(energy);
            deriver.entries.extend_from_slice(&entries[others..]);
            written.push(deriver.entries);
        }
        if passes.run(Pass::QuadraticForm) {
            written.extend(quadratic::entries(&mut graph, energy, &entries));
        }
        let vanishing = vanishing(&graph, &written);
        for entries in std::iter::once(&mut entries).chain(&mut written) {
            entries.retain(|entry| !vanishing.contains(&entry.place));
        }
        // Choices introduced to take limits are not choices of the model.
        let structure = Structure::of(&graph, form, &dof, &entries);
        take_limits(
            &mut graph,
            std::iter::once(&mut entries).chain(&mut written),
        );
        Self {
            graph,
            entries,
            written,
            structure,
            sensitivities,
            passes,
            programs: RefCell::default(),
        }
    }

    /// Whether ∂/∂z of the energy function depends on the time.
    pub fn momenta_move(&self) -> bool {
        let momenta = self
            .entries
            .iter()
            .filter(|entry| entry.place.array == Array::ByZ);
        let mut inputs = momenta.flat_map(|entry| self.graph.inputs_of(entry.value));
        inputs.any(|input| matches!(input, Input::Time | Input::Control(_)))
    }

    /// What is known about the model.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }
}

/// The places where one of the ways gives zero: the others give zero there as well, except for rounding errors.
fn vanishing(graph: &Graph, written: &[Vec<Entry>]) -> SortedSet<Place> {
    let is_zero = |value: ExprId| graph.as_constant(value).is_some_and(Constant::is_zero);
    let all = written.iter().flatten();
    all.filter(|entry| is_zero(entry.value))
        .map(|entry| entry.place.clone())
        .collect()
}

/// Collects the entries.
struct Deriver<'a> {
    form: Form,
    sweep: Sweep,
    graph: &'a mut Graph,
    entries: Vec<Entry>,
}

/// A term of a sum over ranges: the body inside of its loops, outermost first.
struct Term {
    nest: Vec<SumRange>,
    body: ExprId,
}

/// A leaf that derivatives are taken by.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Slot {
    Z(Affine),
    Q(Affine),
}

/// ∂/∂slot, to be added on every turn of a nest of loops.
struct Contribution {
    nest: Vec<SumRange>,
    slot: Slot,
    value: ExprId,
}

impl Deriver<'_> {
    fn push(&mut self, nest: &[SumRange], place: Place, value: ExprId) {
        if !self.graph.as_constant(value).is_some_and(Constant::is_zero) {
            self.entries.push(Entry {
                nest: nest.to_vec(),
                place,
                value,
            });
        }
    }

    fn energy(&mut self, energy: ExprId) {
        let energy = self.graph.open_single_sums(&[energy])[0];
        for Term { nest, body } in self.terms(&[], energy) {
            self.push(&nest, Place::scalar(Array::Value), body);
            if self.graph.contains_sum(body) {
                self.coupled_energy(&nest, body);
            } else {
                self.plain_energy(&nest, body);
            }
        }
    }

    /// Derivatives of a body without sums, each pair of slots once.
    fn plain_energy(&mut self, nest: &[SumRange], body: ExprId) {
        let slots = self.slots(body);
        let leaves: Vec<ExprId> = slots.iter().map(|(_, leaf)| *leaf).collect();
        let slopes = self.sweep.slopes(self.graph, body, &leaves);
        for ((slot, _), slope) in slots.iter().zip(&slopes) {
            self.push(nest, first_place(slot), *slope);
        }
        for (at, (second, leaf)) in slots.iter().enumerate() {
            let mut known = Forward::default();
            for ((first, _), slope) in slots.iter().zip(&slopes).take(at + 1) {
                let value = along(&mut known, self.graph, *slope, *leaf);
                self.push_second(nest, first, second, value);
                if first != second {
                    self.push_second(nest, second, first, value);
                }
            }
        }
    }

    fn push_second(&mut self, nest: &[SumRange], first: &Slot, second: &Slot, value: ExprId) {
        let (array, row, column) = match (first, second) {
            (Slot::Z(row), Slot::Z(column)) => (Array::ZZ, row, column),
            (Slot::Z(row), Slot::Q(column)) => (Array::ZQ, row, column),
            // The other order of the pair gives this entry.
            (Slot::Q(_), Slot::Z(_)) => return,
            (Slot::Q(row), Slot::Q(column)) => (Array::QQ, row, column),
        };
        let place = Place {
            array,
            row: row.clone(),
            column: column.clone(),
        };
        self.push(nest, place, value);
    }

    /// Derivatives of a function of sums over ranges.
    fn coupled_energy(&mut self, nest: &[SumRange], body: ExprId) {
        for first in self.contributions(nest, body) {
            self.push(&first.nest, first_place(&first.slot), first.value);
            for second in self.contributions(&first.nest, first.value) {
                self.push_second(&second.nest, &first.slot, &second.slot, second.value);
            }
        }
    }

    fn dissipation(&mut self, dissipation: ExprId) {
        let dissipation = self.graph.open_single_sums(&[dissipation])[0];
        for Contribution { nest, slot, value } in self.contributions(&[], dissipation) {
            if let Slot::Z(target) = slot {
                let force = self.graph.negate(value);
                self.force(nest, target, force);
            }
        }
    }

    fn force(&mut self, nest: Vec<SumRange>, target: Affine, value: ExprId) {
        let value = self.graph.open_single_sums(&[value])[0];
        for term in self.terms(&nest, value) {
            self.push(
                &term.nest,
                Place::vector(Array::Force, target.clone()),
                term.body,
            );
        }
        for Contribution { nest, slot, value } in self.contributions(&nest, value) {
            let (array, column) = match slot {
                Slot::Z(column) => (Array::ForceZ, column),
                Slot::Q(column) => (Array::ForceQ, column),
            };
            self.push(
                &nest,
                Place {
                    array,
                    row: target.clone(),
                    column,
                },
                value,
            );
        }
    }

    fn observables(&mut self, observables: &[Observable]) {
        let by_site = observables.iter().any(|one| !one.ranges.is_empty());
        for (number, one) in observables.iter().enumerate() {
            let place = match by_site {
                true => Place::vector(Array::SiteObservable, one.column.clone()),
                false => Place::scalar(Array::Observable(number)),
            };
            self.push(&one.ranges, place, one.value);
        }
    }

    /// The slots of a body and their leaves, except those inside its sums.
    fn slots(&mut self, body: ExprId) -> Vec<(Slot, ExprId)> {
        let slot = |id: ExprId| match self.graph.node(id) {
            Node::Input(Input::Coordinate(index)) => Some((Slot::Q(index.clone()), id)),
            Node::Input(Input::Velocity(index)) if self.form == Form::Lagrangian => {
                Some((Slot::Z(index.clone()), id))
            }
            Node::Input(Input::Momentum(index)) if self.form == Form::Hamiltonian => {
                Some((Slot::Z(index.clone()), id))
            }
            _ => None,
        };
        let mut slots: Vec<_> = self
            .graph
            .reachable_outside_sums(&[body])
            .into_iter()
            .filter_map(slot)
            .collect();
        sort(&mut slots);
        slots
    }

    /// First derivatives of an expression inside a nest of loops, by all slots, also through its sums.
    fn contributions(&mut self, nest: &[SumRange], expression: ExprId) -> Vec<Contribution> {
        let mut done = Vec::new();
        // A list of (nest, weight, expression): derivatives of the expression, to be multiplied by the weight, that
        // remain to be taken.
        let one = self.graph.constant(Constant::ONE);
        let mut waiting = vec![(nest.to_vec(), one, expression)];
        while let Some((nest, weight, expression)) = waiting.pop() {
            for Term { nest, body } in self.terms(&nest, expression) {
                let slots = self.slots(body);
                let sums: Vec<ExprId> = self
                    .graph
                    .reachable_outside_sums(&[body])
                    .into_iter()
                    .filter(|id| matches!(self.graph.node(*id), Node::Loop { .. }))
                    .collect();
                let leaves: Vec<ExprId> = slots
                    .iter()
                    .map(|(_, leaf)| *leaf)
                    .chain(sums.iter().copied())
                    .collect();
                let slopes = gradient(self.graph, body, &leaves);
                let (direct, through) = slopes.split_at(slots.len());
                for ((slot, _), slope) in slots.into_iter().zip(direct) {
                    let value = self.graph.multiply(weight, *slope);
                    if !self.graph.as_constant(value).is_some_and(Constant::is_zero) {
                        done.push(Contribution {
                            nest: nest.clone(),
                            slot,
                            value,
                        });
                    }
                }
                for (sum, slope) in sums.into_iter().zip(through) {
                    let weight = self.graph.multiply(weight, *slope);
                    waiting.push((nest.clone(), weight, sum));
                }
            }
        }
        done
    }

    /// Splits an expression into terms, each a body inside its own loops; a body that is linear in no sum keeps its sums.
    fn terms(&mut self, nest: &[SumRange], expression: ExprId) -> Vec<Term> {
        let mut bodies = Bodies::new();
        let mut waiting = vec![(nest.to_vec(), Constant::ONE, expression)];
        // Level by level, so that an expression reached by several paths is opened once, with the sum of their factors.
        while !waiting.is_empty() {
            for (nest, factor, id) in std::mem::take(&mut waiting) {
                self.open(nest, factor, id, (&mut bodies, &mut waiting));
            }
            waiting = merged(waiting);
        }
        let mut terms = Vec::with_capacity(bodies.len());
        for (nest, parts) in bodies {
            terms.push(Term {
                nest,
                body: self.graph.linear(Constant::ZERO, &parts),
            });
        }
        terms
    }

    /// Opens a sum, a loop, or a product that is linear in one of them, into further parts; anything else is a body.
    fn open(
        &mut self,
        nest: Vec<SumRange>,
        factor: Constant,
        id: ExprId,
        (bodies, waiting): (&mut Bodies, &mut Vec<Part>),
    ) {
        if !self.graph.contains_sum(id) {
            bodies.get_or_default(nest).push((factor, id));
            return;
        }
        match self.graph.node(id).clone() {
            Node::Sum { constant, terms } => {
                if !constant.is_zero() {
                    let one = self.graph.constant(Constant::ONE);
                    bodies
                        .get_or_default(nest.clone())
                        .push((factor * constant, one));
                }
                waiting.extend(
                    terms
                        .into_iter()
                        .map(|(c, x)| (nest.clone(), factor * c, x)),
                );
            }
            Node::Loop { range, body } => {
                let (range, body) = self.inside(&nest, range, body);
                let mut nest = nest;
                nest.push(range);
                waiting.push((nest, factor, body));
            }
            Node::Product(factors) => {
                let mut with_sums = factors
                    .iter()
                    .enumerate()
                    .filter(|(_, (x, _))| self.graph.contains_sum(*x));
                let only = with_sums
                    .next()
                    .filter(|(_, (_, n))| *n == 1 && with_sums.next().is_none());
                let inner = only.map(|(at, (x, _))| (at, self.graph.node(*x).clone()));
                match inner {
                    Some((at, Node::Loop { range, body })) => {
                        let (range, body) = self.inside(&nest, range, body);
                        let mut rest = factors.clone();
                        rest.remove(at);
                        rest.push((body, 1));
                        let body = self.graph.product(Constant::ONE, &rest);
                        let mut nest = nest;
                        nest.push(range);
                        waiting.push((nest, factor, body));
                    }
                    Some((at, Node::Sum { constant, terms })) => {
                        let mut rest = factors.clone();
                        rest.remove(at);
                        for (c, x) in terms {
                            let mut factors = rest.clone();
                            factors.push((x, 1));
                            let product = self.graph.product(Constant::ONE, &factors);
                            waiting.push((nest.clone(), factor * c, product));
                        }
                        if !constant.is_zero() {
                            let product = self.graph.product(Constant::ONE, &rest);
                            waiting.push((nest, factor * constant, product));
                        }
                    }
                    _ => bodies.get_or_default(nest).push((factor, id)),
                }
            }
            _ => bodies.get_or_default(nest).push((factor, id)),
        }
    }

    /// A range and its body with an index that the nest does not use yet.
    fn inside(&mut self, nest: &[SumRange], range: SumRange, body: ExprId) -> (SumRange, ExprId) {
        if nest.iter().all(|outer| outer.variable != range.variable) {
            return (range, body);
        }
        let bound =
            self.graph
                .reachable(&[body])
                .into_iter()
                .filter_map(|id| match self.graph.node(id) {
                    Node::Loop { range, .. } => Some(range.variable.0),
                    _ => None,
                });
        let used = nest
            .iter()
            .map(|outer| outer.variable.0)
            .chain(bound)
            .max()
            .unwrap_or(0);
        let variable = LoopVariable(used.saturating_add(1));
        let symbol = Affine::symbol(IndexSymbol::Loop(variable));
        let body = self.graph.substitute_loop(body, range.variable, &symbol);
        (SumRange { variable, ..range }, body)
    }
}

/// Bodies and their factors, by the loops around them.
type Bodies = SortedMap<Vec<SumRange>, Vec<(Constant, ExprId)>>;

/// A part of an expression inside loops, and its factor.
type Part = (Vec<SumRange>, Constant, ExprId);

/// Combines equal parts into one with the sum of their factors, in the order of first occurrence.
fn merged(parts: Vec<Part>) -> Vec<Part> {
    let mut places: SortedMap<(Vec<SumRange>, ExprId), usize> = SortedMap::new();
    let mut merged: Vec<Part> = Vec::with_capacity(parts.len());
    for (nest, factor, id) in parts {
        let key = (nest.clone(), id);
        match places.get(&key) {
            Some(&place) => merged[place].1 = merged[place].1 + factor,
            None => {
                places.insert(key, merged.len());
                merged.push((nest, factor, id));
            }
        }
    }
    merged
}

fn first_place(slot: &Slot) -> Place {
    match slot {
        Slot::Z(index) => Place::vector(Array::ByZ, index.clone()),
        Slot::Q(index) => Place::vector(Array::ByQ, index.clone()),
    }
}
