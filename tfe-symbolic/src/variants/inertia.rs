//! Whether every coordinate of a model made from another one still has kinetic energy.

use crate::expr::constant::Constant;
use crate::expr::differentiate::derivative;
use crate::expr::input::{Affine, Input};
use crate::model::declared::{Declared, Form, names};

/// The first coordinate whose momentum depends on no velocity, or whose velocity depends on no momentum; coordinates on
/// which constraints act do not count.
pub(super) fn missing(model: &mut Declared) -> Option<String> {
    if model.graph.holds_varying_index(model.energy) {
        return None;
    }
    for (at, name) in (0..).zip(names(&model.coordinates)) {
        let index = Affine::constant(at);
        if !is_constrained(model, &index) && is_massless(model, index) {
            return Some(name);
        }
    }
    None
}

fn is_constrained(model: &Declared, at: &Affine) -> bool {
    let holds = |input: &Input| match input {
        Input::Coordinate(own) | Input::Velocity(own) => own == at,
        _ => false,
    };
    let mut values = model.constraints.iter().map(|constraint| constraint.value);
    values.any(|value| model.graph.inputs_of(value).iter().any(holds))
}

fn is_massless(model: &mut Declared, at: Affine) -> bool {
    let graph = &mut model.graph;
    match model.form {
        Form::Lagrangian => {
            let momentum = derivative(graph, model.energy, &Input::Velocity(at));
            let is_velocity = |input: &Input| matches!(input, Input::Velocity(_));
            !graph.inputs_of(momentum).iter().any(is_velocity)
        }
        Form::Hamiltonian => {
            let velocity = derivative(graph, model.energy, &Input::Momentum(at));
            graph.as_constant(velocity).is_some_and(Constant::is_zero)
        }
    }
}
