//! Cyclic coordinates ignored (Routh), (T-109): their momenta are parameters of the model that is left.
//!
//! ```text
//! L = L₀ + a v + ½ m v² ,     v = (β − a)/m ,     R = L − β v = L₀ − (β − a)²/(2m)
//! ```
//!
//! for one ignored coordinate with the velocity v and the constant momentum β; several go one after the other. Of a Hamiltonian the momentum
//! becomes the parameter, and v = ∂H/∂p. The velocities become outputs, so that the coordinates can be had by a quadrature.

use super::target::Places;
use super::{Ignored, Mistake, Reduction};
use crate::derive::structure::deciding;
use crate::diagnostic::{Kind, Span};
use crate::expr::constant::Constant;
use crate::expr::differentiate::derivative;
use crate::expr::graph::{ExprId, Graph};
use crate::expr::input::{Affine, Input};
use crate::expr::sorting::sort;
use crate::model::declared::{Form, Observable, names};

const PASS: &str = "routh";

/// A cyclic coordinate that leaves.
struct Cyclic {
    at: i64,
    /// As people write it, `q[2]`.
    name: String,
    /// The field that holds its momentum.
    momentum: String,
    /// Its velocity in terms of what stays; at first only once those after it are known.
    rate: Option<ExprId>,
}

impl Reduction {
    pub(super) fn ignore(
        &mut self,
        ignored: &[Ignored],
        fields: &[String],
        place: impl Fn(Kind) -> Mistake,
    ) -> Result<(), Mistake> {
        if self.model.dof.as_constant().is_none() {
            return Err(place(Kind::PassOfLength { pass: PASS }));
        }
        self.write_out(PASS).map_err(&place)?;
        let mut all = self.cyclic(ignored, fields)?;
        let numbers: Vec<i64> = all.iter().map(|one| one.at).collect();
        self.drop_outputs(&numbers);
        let rates = match self.model.form {
            Form::Lagrangian => self.eliminate(&mut all).map_err(&place)?,
            Form::Hamiltonian => self.hold_momenta(&mut all).map_err(&place)?,
        };
        for (one, rate) in all.iter().zip(rates) {
            self.add_rate(one, rate).map_err(&place)?;
            let words = format!("The momentum that belongs to `{}`, a constant.", one.name);
            self.added.push((one.momentum.clone(), words));
            let original = self.kept.get(usize::try_from(one.at).unwrap_or(usize::MAX));
            self.from_state.extend(original.copied());
        }
        let mut removed = numbers;
        sort(&mut removed);
        for at in removed.iter().rev() {
            if let Ok(at) = usize::try_from(*at)
                && at < self.kept.len()
            {
                self.kept.remove(at);
            }
        }
        self.remove(&removed, PASS).map_err(&place)
    }

    /// The coordinates named, each found to be cyclic and free of forces.
    fn cyclic(&self, ignored: &[Ignored], fields: &[String]) -> Result<Vec<Cyclic>, Mistake> {
        let mut all: Vec<Cyclic> = Vec::new();
        for Ignored { target, span } in ignored {
            let wrong = |kind| (*span, kind);
            let places = target
                .places(&self.model.coordinates, PASS)
                .map_err(wrong)?;
            let Places::Numbers(places) = places else {
                return Err(wrong(Kind::PassOfLength { pass: PASS }));
            };
            let names = names(&self.model.coordinates);
            for at in places {
                let name = usize::try_from(at).ok().and_then(|at| names.get(at));
                let name = name.cloned().unwrap_or_default();
                if all.iter().any(|one| one.at == at) {
                    return Err(wrong(Kind::RepeatedEntry { name }));
                }
                self.check_cyclic(at, &name, *span)?;
                let momentum = format!("p_{}", plain(&name));
                let added = self.added.iter().map(|(name, _)| name);
                if fields.iter().chain(added).any(|field| *field == momentum) {
                    let (name, coordinate) = (momentum, name);
                    return Err(wrong(Kind::RouthName { name, coordinate }));
                }
                all.push(Cyclic {
                    at,
                    name,
                    momentum,
                    rate: None,
                });
            }
        }
        Ok(all)
    }

    /// Nothing but outputs may hold the coordinate, and no force may act on it.
    fn check_cyclic(&self, at: i64, name: &str, span: Span) -> Result<(), Mistake> {
        let model = &self.model;
        let index = Affine::constant(at);
        let (coordinate, velocity) = (
            Input::Coordinate(index.clone()),
            Input::Velocity(index.clone()),
        );
        let holds = |id: ExprId, input: &Input| model.graph.inputs_of(id).contains(input);
        let name = name.to_owned();
        let forces = model.forces.iter().map(|force| force.value);
        let mut formulas = [model.energy]
            .into_iter()
            .chain(model.dissipation)
            .chain(forces);
        if formulas.any(|id| holds(id, &coordinate)) {
            return Err((span, Kind::NotCyclic { name }));
        }
        let mut constraints = model.constraints.iter().map(|one| one.value);
        if constraints.any(|id| holds(id, &coordinate) || holds(id, &velocity)) {
            return Err((span, Kind::CyclicConstrained { name }));
        }
        let momentum = Input::Momentum(index.clone());
        let pushed = model.forces.iter().any(|force| force.target == index);
        let mut damping = model.dissipation.into_iter();
        if pushed || damping.any(|id| holds(id, &velocity) || holds(id, &momentum)) {
            return Err((span, Kind::CyclicForced { name }));
        }
        Ok(())
    }

    /// Outputs that hold an ignored coordinate cannot be had any more.
    fn drop_outputs(&mut self, numbers: &[i64]) {
        let model = &mut self.model;
        let graph = &model.graph;
        let is_ignored = |input: &Input| match input {
            Input::Coordinate(at) => at.as_constant().is_some_and(|at| numbers.contains(&at)),
            _ => false,
        };
        model
            .observables
            .retain(|one| !graph.inputs_of(one.value).iter().any(is_ignored));
        for (column, one) in (0..).zip(&mut model.observables) {
            one.column = Affine::constant(column);
        }
    }

    /// The Routhian in place of L; the velocities in terms of what stays, in the order of `all`.
    fn eliminate(&mut self, all: &mut [Cyclic]) -> Result<Vec<ExprId>, Kind> {
        let mut order = Vec::new();
        while let Some((number, inertia)) = self.simplest(all) {
            self.eliminate_one(&mut all[number], inertia)?;
            order.push(number);
        }
        let graph = &mut self.model.graph;
        // The velocity found last holds none of the others, that before only the last, and so on.
        for (found, number) in order.iter().enumerate().rev() {
            for later in &order[found + 1..] {
                let (at, value) = (all[*later].at, all[*later].rate);
                let own = all[*number].rate.zip(value);
                all[*number].rate = own.map(|(own, value)| with_rate(graph, own, at, value));
            }
        }
        let rates: Vec<ExprId> = all.iter().filter_map(|one| one.rate).collect();
        let numbers: Vec<i64> = all.iter().map(|one| one.at).collect();
        self.each_formula(&mut |graph, id| {
            let pairs = numbers.iter().zip(&rates);
            Ok(pairs.fold(id, |id, (at, rate)| with_rate(graph, id, *at, *rate)))
        })?;
        Ok(rates)
    }

    /// The coordinate with the simplest inertia among those that are still there, and that inertia: with it gone, parts of others often cancel.
    fn simplest(&mut self, all: &[Cyclic]) -> Option<(usize, ExprId)> {
        let (graph, energy) = (&mut self.model.graph, self.model.energy);
        let left = all.iter().enumerate().filter(|(_, one)| one.rate.is_none());
        let sized = left.map(|(number, one)| {
            let inertia = inertia(graph, energy, one.at);
            (graph.reachable(&[inertia]).len(), number, inertia)
        });
        let least = sized.min_by_key(|(size, ..)| *size);
        least.map(|(_, number, inertia)| (number, inertia))
    }

    /// R of one coordinate, and its velocity.
    fn eliminate_one(&mut self, one: &mut Cyclic, inertia: ExprId) -> Result<(), Kind> {
        let graph = &mut self.model.graph;
        let velocity = Input::Velocity(Affine::constant(one.at));
        if graph.as_constant(inertia).is_some_and(Constant::is_zero)
            || graph.inputs_of(inertia).contains(&velocity)
            || decides(graph, self.model.energy, &velocity)
        {
            let name = one.name.clone();
            return Err(Kind::CyclicNotQuadratic { name });
        }
        let slope = derivative(graph, self.model.energy, &velocity);
        let rest = graph.integer(0);
        let (a, at_rest) = (
            with_rate(graph, slope, one.at, rest),
            with_rate(graph, self.model.energy, one.at, rest),
        );
        let beta = graph.input(Input::Parameter(one.momentum.clone()));
        let momentum = graph.subtract(beta, a);
        one.rate = Some(graph.product(Constant::ONE, &[(momentum, 1), (inertia, -1)]));
        let half = Constant::integer(2).reciprocal().unwrap_or(Constant::ZERO);
        let lost = graph.product(half, &[(momentum, 2), (inertia, -1)]);
        self.model.energy = graph.subtract(at_rest, lost);
        Ok(())
    }

    /// Parameters in place of momenta; the velocities ∂H/∂p.
    fn hold_momenta(&mut self, all: &mut [Cyclic]) -> Result<Vec<ExprId>, Kind> {
        let fields: Vec<(i64, String)> = all
            .iter()
            .map(|one| (one.at, one.momentum.clone()))
            .collect();
        let held = |graph: &mut Graph, id: ExprId| {
            graph.with_leaves(id, &mut |graph, input| {
                let Input::Momentum(at) = input else {
                    return None;
                };
                let own = fields
                    .iter()
                    .find(|(own, _)| at.as_constant() == Some(*own))?;
                Some(graph.input(Input::Parameter(own.1.clone())))
            })
        };
        let energy = self.model.energy;
        let graph = &mut self.model.graph;
        let rates = all.iter().map(|one| {
            let rate = derivative(graph, energy, &Input::Momentum(Affine::constant(one.at)));
            held(graph, rate)
        });
        let rates: Vec<ExprId> = rates.collect();
        self.each_formula(&mut |graph, id| Ok(held(graph, id)))?;
        Ok(rates)
    }

    /// The velocity of an ignored coordinate as an output.
    fn add_rate(&mut self, one: &Cyclic, rate: ExprId) -> Result<(), Kind> {
        let name = format!("{}_rate", plain(&one.name));
        let outputs = &mut self.model.observables;
        if outputs.iter().any(|output| output.name == name) {
            let coordinate = one.name.clone();
            return Err(Kind::RouthName { name, coordinate });
        }
        let column = Affine::constant(i64::try_from(outputs.len()).unwrap_or(i64::MAX));
        outputs.push(Observable {
            name,
            ranges: Vec::new(),
            column,
            value: rate,
        });
        Ok(())
    }
}

/// ∂²L/∂v²
fn inertia(graph: &mut Graph, energy: ExprId, at: i64) -> ExprId {
    let velocity = Input::Velocity(Affine::constant(at));
    let momentum = derivative(graph, energy, &velocity);
    derivative(graph, momentum, &velocity)
}

/// Whether the sign of something that holds a velocity decides: the inertia does not show that, as |v| has none.
fn decides(graph: &Graph, energy: ExprId, velocity: &Input) -> bool {
    let nodes = graph.reachable(&[energy]).into_iter();
    let mut deciding = nodes.flat_map(|id| deciding(graph.node(id)));
    deciding.any(|id| graph.inputs_of(id).contains(velocity))
}

fn with_rate(graph: &mut Graph, id: ExprId, at: i64, rate: ExprId) -> ExprId {
    let velocity = Input::Velocity(Affine::constant(at));
    graph.with_leaves(id, &mut |_, input| (*input == velocity).then_some(rate))
}

/// `q_2` for `q[2]`
fn plain(name: &str) -> String {
    name.replace('[', "_").replace(']', "")
}
