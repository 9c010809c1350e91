//! The names of outputs and of constraints, which stand beside each other in results.

use super::{Model, Symbol, reserved, unusable_type_name};
use crate::diagnostic::{Bag, Kind, Role};
use crate::syntax::ast::Spanned;

/// The methods that the macro gives every model; outputs become further methods.
const METHODS: &[&str] = &["state", "structure"];
/// The functions that the macro gives models made from another model.
const VARIANT_METHODS: &[&str] = &["of", "of_state"];
/// A further function, for models with a time transformation.
const CLOCK_METHOD: &str = "state_at";

impl Model {
    pub(super) fn outputs(&self, bag: &mut Bag) {
        let mut names: Vec<&str> = Vec::new();
        for (Spanned { node: name, span }, range, _) in &self.outputs {
            if let Some(range) = range
                && !self.dof.is_of_run_time()
            {
                bag.push(range.variable.span.join(range.end.span), Kind::OutputFamily);
            }
            if let Some(kind) = reserved(name, false).or_else(|| self.clock_momentum(name)) {
                bag.push(*span, kind);
            }
            // An output may have the name of the `let` that it shows; a coordinate or momentum has its column in the
            // results already.
            let taken = match self.symbols.get(name) {
                Some(symbol @ (Symbol::Coordinate(_) | Symbol::Momentum(_))) => Some(symbol.role()),
                _ if self.is_method(name) => Some(Role::Method),
                _ => names.contains(&name.as_str()).then_some(Role::Output),
            };
            if let Some(taken) = taken {
                bag.push(
                    *span,
                    Kind::NameClash {
                        name: name.clone(),
                        taken,
                    },
                );
            }
            names.push(name);
        }
    }

    /// Whether the macro gives the model a method of this name.
    fn is_method(&self, name: &str) -> bool {
        METHODS.contains(&name)
            || (self.time_transformation.is_some() && name == CLOCK_METHOD)
            || (!self.variants.is_empty() && VARIANT_METHODS.contains(&name))
    }

    /// Checks the names of constraints, which do not appear in formulas, but in results beside outputs.
    pub(super) fn constraint_names(&self, bag: &mut Bag) {
        let mut names: Vec<&str> = Vec::new();
        for (Spanned { node: name, span }, ..) in &self.constraints {
            let taken = if names.contains(&name.as_str()) {
                Some(Role::Constraint)
            } else {
                let mut outputs = self.outputs.iter();
                let output = outputs.any(|(output, ..)| output.node == *name);
                output.then_some(Role::Output)
            };
            if let Some(taken) = taken {
                let name = name.clone();
                bag.push(*span, Kind::NameClash { name, taken });
            } else if let Some(kind) = unusable_type_name(name) {
                bag.push(*span, kind);
            }
            names.push(name);
        }
    }
}
