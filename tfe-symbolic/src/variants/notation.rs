//! The formulas of a model made from another one, for its documentation.

use crate::diagnostic::Bag;
use crate::expr::graph::ExprId;
use crate::expr::input::Input;
use crate::model::declared::{Declared, names};
use crate::model::notation::{Notation, formula};
use crate::syntax::parse::parse_expression;

/// Longer formulas are for kernels only.
const READABLE: usize = 400;

/// Where the model comes from, then its formulas as far as they can be read.
pub(super) fn of(model: &Declared, original: &str, made: &str) -> Notation {
    let mut formulas = vec![format!("{original}: {}", made.replace('`', ""))];
    let mut push = |left: String, value: ExprId, right: String| {
        formulas.extend(text(model, value).map(|text| format!("{left} = {text}{right}")));
    };
    push(model.form.letter().to_string(), model.energy, String::new());
    if let Some(dissipation) = model.dissipation {
        push("D".to_owned(), dissipation, String::new());
    }
    let coordinates = names(&model.coordinates);
    for force in &model.forces {
        let target = force
            .target
            .as_constant()
            .and_then(|at| usize::try_from(at).ok());
        if let Some(name) = target.and_then(|at| coordinates.get(at)) {
            let name = crate::model::notation::symbol(name);
            push(format!("Q({name})"), force.value, String::new());
        }
    }
    for constraint in &model.constraints {
        let name = crate::model::notation::symbol(&constraint.name);
        push("0".to_owned(), constraint.value, format!("      ({name})"));
    }
    Notation { formulas }
}

/// An expression in mathematical notation; nothing where it is long or holds indices that vary.
pub(super) fn text(model: &Declared, value: ExprId) -> Option<String> {
    let mut graph = model.graph.clone();
    let (coordinates, momenta) = (names(&model.coordinates), names(&model.momenta));
    let mut nameless = false;
    let named = graph.with_leaves(value, &mut |graph, input| {
        let (names, at, rate) = match input {
            Input::Coordinate(at) => (&coordinates, at, false),
            Input::Velocity(at) => (&coordinates, at, true),
            Input::Momentum(at) => (&momenta, at, false),
            _ => return None,
        };
        let place = at.as_constant().and_then(|at| usize::try_from(at).ok());
        let Some(name) = place.and_then(|at| names.get(at)) else {
            nameless = true;
            return None;
        };
        let name = if rate {
            format!("dot({name})")
        } else {
            name.clone()
        };
        Some(graph.input(Input::Parameter(name)))
    });
    let written = graph.display(named).to_string();
    if nameless || written.len() > READABLE {
        return None;
    }
    let mut bag = Bag::new();
    let parsed = parse_expression(&written, &mut bag);
    // What cannot be read is not told.
    bag.finish(parsed).ok()?.map(|expr| formula(&expr))
}
