//! Springs that become constraints, (T-106).
//!
//! ```text
//! L = L₀ − k Σ c_j φ_j²  ⟶  L₀ ,  φ_j = 0          (of a Hamiltonian, H = H₀ + k Σ c_j φ_j²)
//! ```

use super::{Mistake, Reduction, Spring};
use crate::derive::constraint::{holds_state, kind, normal};
use crate::diagnostic::{Kind, Role};
use crate::expr::constant::Constant;
use crate::expr::differentiate::derivative;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::{Affine, Input};
use crate::model::declared::{Constraint, ConstraintKind, Declared, Form};

impl Reduction {
    pub(super) fn stiffen(&mut self, spring: &Spring) -> Result<(), Mistake> {
        let stiffness = Input::Parameter(spring.stiffness.node.clone());
        let at_stiffness = |kind| (spring.stiffness.span, kind);
        let elongations = self.elongations(&stiffness).map_err(at_stiffness)?;
        let names = names(&spring.constraint.to_string(), elongations.len());
        for (name, elongation) in names.into_iter().zip(elongations) {
            let outwards = outwards(&mut self.model.graph, elongation);
            self.constrain(name, outwards)
                .map_err(|kind| (spring.span, kind))?;
        }
        let model = &mut self.model;
        let zero = model.graph.integer(0);
        model.energy = model.graph.with_leaves(model.energy, &mut |_, input| {
            (*input == stiffness).then_some(zero)
        });
        drop_outputs_of(model, &stiffness);
        Ok(())
    }

    /// φ_j of the springs of this stiffness.
    fn elongations(&mut self, stiffness: &Input) -> Result<Vec<ExprId>, Kind> {
        let model = &mut self.model;
        let wrong = |found: String| Kind::NotASpring {
            field: stiffness.to_string(),
            found,
        };
        if let Some(place) = elsewhere(model, stiffness) {
            return Err(wrong(format!("it also appears in {place}")));
        }
        let (form, graph) = (model.form, &mut model.graph);
        let slope = derivative(graph, model.energy, stiffness);
        let long = Kind::PassOfLength { pass: "rigid" };
        let slope = graph.unroll(slope).map_err(|_| long.clone())?;
        if graph.contains_sum(slope) || model.dof.as_constant().is_none() {
            return Err(long);
        }
        let (constant, terms) = graph.terms(slope);
        let squares = terms
            .iter()
            .map(|term| elongation(graph, form, *term, stiffness));
        let squares: Option<Vec<ExprId>> = squares.collect();
        match squares {
            Some(squares) if constant.is_zero() && !squares.is_empty() => {
                let is_flat = |square: &ExprId| has_no_slope(graph, *square);
                let flat = squares.iter().copied().find(is_flat);
                let Some(flat) = flat else {
                    return Ok(squares);
                };
                let flat = super::notation::text(&self.model, flat);
                let flat = flat.unwrap_or_else(|| "the elongation".to_owned());
                Err(wrong(format!(
                    "the gradient of {flat} vanishes where it is zero"
                )))
            }
            _ => {
                let slope = super::notation::text(&self.model, slope);
                let slope = slope.unwrap_or_else(|| "not such a square".to_owned());
                let letter = form.letter();
                Err(wrong(format!("∂{letter}/∂{stiffness} is {slope}")))
            }
        }
    }

    fn constrain(&mut self, name: String, value: ExprId) -> Result<(), Kind> {
        let Declared {
            graph,
            constraints,
            observables,
            ..
        } = &mut self.model;
        let taken = if constraints.iter().any(|other| other.name == name) {
            Some(Role::Constraint)
        } else {
            let mut observables = observables.iter();
            observables
                .any(|one| one.name == name)
                .then_some(Role::Output)
        };
        if let Some(taken) = taken {
            return Err(Kind::NameClash { name, taken });
        }
        let own = normal(graph, value);
        if let Some(other) = constraints
            .iter()
            .find(|other| normal(graph, other.value) == own)
        {
            let other = other.name.clone();
            return Err(Kind::RepeatedConstraint { name, other });
        }
        let quadratic = ConstraintKind::Holonomic { quadratic: false };
        let kind = kind(graph, value).unwrap_or(quadratic);
        constraints.push(Constraint {
            name,
            ranges: Vec::new(),
            row: Affine::constant(constraints.len() as i64),
            kind,
            value,
        });
        Ok(())
    }
}

/// φ or −φ, of which the square tells neither: the one that grows with what changes in it, as r − l. Where that has terms
/// of both signs, as x₂ − x₁ − l, it is the one from which the rest is subtracted; without a rest φ as it is.
fn outwards(graph: &mut Graph, elongation: ExprId) -> ExprId {
    let (constant, terms) = graph.terms(elongation);
    let (moving, fixed): (Vec<_>, Vec<_>) =
        (terms.into_iter()).partition(|(_, x)| holds_state(graph, *x));
    let is_negative = |(c, _): &(Constant, ExprId)| c.is_negative();
    let falls = if moving.iter().all(is_negative) {
        true
    } else if moving.iter().any(is_negative) {
        let has_rest = !(constant.is_zero() && fixed.is_empty());
        has_rest && !constant.is_negative() && !fixed.iter().any(is_negative)
    } else {
        false
    };
    if falls {
        graph.negate(elongation)
    } else {
        elongation
    }
}

/// `rod`, or `rod_1`, `rod_2`, …
fn names(name: &str, count: usize) -> Vec<String> {
    match count {
        1 => vec![name.to_owned()],
        _ => (1..=count)
            .map(|number| format!("{name}_{number}"))
            .collect(),
    }
}

/// Where a parameter stands beside the energy and outputs.
fn elsewhere(model: &Declared, parameter: &Input) -> Option<&'static str> {
    let holds = |value: &ExprId| model.graph.inputs_of(*value).contains(parameter);
    let mut forces = model.forces.iter().map(|force| force.value);
    let mut constraints = model.constraints.iter().map(|constraint| constraint.value);
    if forces.any(|value| holds(&value)) {
        Some("a force")
    } else if model.dissipation.as_ref().is_some_and(holds) {
        Some("the dissipation")
    } else {
        let found = constraints.any(|value| holds(&value));
        found.then_some("a constraint")
    }
}

/// φ where the term is c f φ^2n, with c of the sign of an elastic energy, f of other fields as A/l in E A φ²/(2 l), and φ a
/// function of positions.
fn elongation(
    graph: &mut Graph,
    form: Form,
    (coefficient, x): (Constant, ExprId),
    stiffness: &Input,
) -> Option<ExprId> {
    let Node::Product(factors) = graph.node(x).clone() else {
        return None;
    };
    let (scale, others): (Vec<_>, Vec<_>) = factors
        .iter()
        .copied()
        .partition(|(y, _)| is_scale(graph, *y, stiffness));
    // A sum of fields, as 1 − ν², may have either sign.
    let is_sum = |(y, _): &(ExprId, i32)| matches!(graph.node(*y), Node::Sum { .. });
    let has_sign = !scale.iter().any(is_sum);
    if has_sign && coefficient.is_negative() != (form == Form::Lagrangian) {
        return None;
    }
    let root = root_of_even_power(graph, &factors);
    let root = root.or_else(|| root_of_even_power(graph, &others))?;
    let moves = |input: &Input| matches!(input, Input::Velocity(_) | Input::Momentum(_));
    let inputs = graph.inputs_of(root);
    let is_position = !inputs.iter().any(moves) && !inputs.contains(stiffness);
    (is_position && holds_state(graph, root)).then_some(root)
}

/// Whether an expression consists of fields other than the stiffness.
fn is_scale(graph: &Graph, x: ExprId, stiffness: &Input) -> bool {
    let is_field =
        |input: &Input| matches!(input, Input::Parameter(_) | Input::ParameterElement(..));
    let inputs = graph.inputs_of(x);
    inputs.iter().all(is_field) && !inputs.contains(stiffness)
}

/// The root of a product that is an even power of something.
fn root_of_even_power(graph: &mut Graph, factors: &[(ExprId, i32)]) -> Option<ExprId> {
    let common = factors
        .iter()
        .fold(0, |divisor, (_, n)| greatest_common_divisor(divisor, *n));
    if common == 0 || common % 2 != 0 || factors.iter().any(|(_, n)| *n < 0) {
        return None;
    }
    let roots: Vec<(ExprId, i32)> = factors.iter().map(|(x, n)| (*x, n / common)).collect();
    Some(graph.product(Constant::ONE, &roots))
}

/// Whether a constraint has a row of zeros, or of zero over zero, where it holds: the elongation of a one-sided spring, as max(x, 0), or a sum of squares.
fn has_no_slope(graph: &mut Graph, elongation: ExprId) -> bool {
    let mapping = graph.with_nodes(elongation, &mut |graph, old, mapping| {
        let branches = match graph.node(old) {
            Node::Select {
                then, otherwise, ..
            } => [*then, *otherwise],
            Node::Call {
                function: Function::Min | Function::Max,
                arguments,
            } => [*arguments.first()?, *arguments.get(1)?],
            _ => return None,
        };
        let mut branches = branches.into_iter().map(|branch| mapping.of(branch));
        branches.find(|branch| !holds_state(graph, *branch))
    });
    let slack = mapping.of(elongation);
    if graph.as_constant(slack).is_some_and(Constant::is_zero) {
        return true;
    }
    if let Node::Call {
        function: Function::Hypot,
        ..
    } = graph.node(elongation)
    {
        return true;
    }
    let (constant, terms) = graph.terms(elongation);
    let is_square = |(c, x): &(Constant, ExprId)| match graph.node(*x) {
        Node::Product(factors) => !c.is_negative() && factors.iter().all(|(_, n)| n % 2 == 0),
        _ => false,
    };
    constant.is_zero() && terms.iter().all(is_square)
}

fn greatest_common_divisor(a: i32, b: i32) -> i32 {
    let (mut a, mut b) = (a, b);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a.saturating_abs()
}

/// What shows a parameter that is gone cannot be shown; the others move up.
fn drop_outputs_of(model: &mut Declared, parameter: &Input) {
    let Declared {
        graph, observables, ..
    } = model;
    observables.retain(|one| !graph.inputs_of(one.value).contains(parameter));
    for (at, one) in (0..).zip(observables) {
        one.column = Affine::constant(at);
    }
}
