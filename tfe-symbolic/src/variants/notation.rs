//! The formulas of a model made from another one, for its documentation.

use super::as_syntax::{as_syntax, call, element, name};
use crate::expr::graph::ExprId;
use crate::expr::input::{Affine, Input};
use crate::model::declared::{CoordinateArray, Declared, names};
use crate::model::notation::{Notation, formula};
use crate::syntax::ast::Expr;

/// Longer formulas are not printed.
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
    let state = |input: &Input| match input {
        Input::Coordinate(at) => slot(&model.coordinates, at),
        Input::Velocity(at) => Some(call("dot", vec![slot(&model.coordinates, at)?])),
        Input::Momentum(at) => slot(&model.momenta, at),
        _ => None,
    };
    // No node is printed in less than a letter.
    let expr = as_syntax(&model.graph, value, READABLE, &state)?;
    (expr.to_string().len() <= READABLE).then(|| formula(&expr))
}

/// The coordinate or momentum at a place of the flat vector, if that is a number.
fn slot(arrays: &[CoordinateArray], at: &Affine) -> Option<Expr> {
    let at = at.as_constant()?;
    let array = arrays.iter().find(|array| {
        let length = array.length.as_ref().map_or(Some(1), Affine::as_constant);
        let first = array.first.as_constant();
        first
            .zip(length)
            .is_some_and(|(first, length)| (first..first + length).contains(&at))
    })?;
    Some(match &array.length {
        None => named(&array.name),
        Some(_) => element(
            name(&array.name),
            &Affine::constant(at - array.first.as_constant()?),
        ),
    })
}

/// A single coordinate, which may be what is left of an array: `q[2]`.
fn named(coordinate: &str) -> Expr {
    let of_array = coordinate
        .strip_suffix(']')
        .and_then(|text| text.split_once('['));
    match of_array.map(|(array, at)| (array, at.parse())) {
        Some((array, Ok(at))) => element(name(array), &Affine::constant(at)),
        _ => name(coordinate),
    }
}
