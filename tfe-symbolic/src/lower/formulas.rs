//! The formulas of a model as the user wrote them, for its documentation.

use crate::check::Model;
use crate::model::notation::{Notation, formula, symbol};

/// The formulas of a checked model.
pub(super) fn formulas(model: &Model) -> Notation {
    let mut formulas = Vec::new();
    for (name, value) in &model.lets {
        formulas.push(format!("{} = {}", symbol(&name.node), formula(value)));
    }
    if let Some((form, value)) = &model.energy {
        formulas.push(format!("{} = {}", form.letter(), formula(value)));
    }
    if let Some(value) = &model.dissipation {
        formulas.push(format!("D = {}", formula(value)));
    }
    if let Some((rate, _)) = &model.time_transformation {
        formulas.push(format!("dt/dτ = {}", formula(rate)));
        formulas.push("H̃ = dt/dτ (H + p_t)".to_owned());
    }
    for (target, value) in &model.forces {
        formulas.push(format!("Q({}) = {}", formula(target), formula(value)));
    }
    for (name, range, value) in &model.constraints {
        let range = range.as_ref().map(|range| {
            let (start, end) = (formula(&range.start), formula(&range.end));
            format!(" for {} = {start}..{end}", symbol(&range.variable.node))
        });
        let (name, range) = (symbol(&name.node), range.unwrap_or_default());
        formulas.push(format!("0 = {}      ({name}{range})", formula(value)));
    }
    Notation { formulas }
}
