//! Models made from the declared one: `model(Name, truncated(2), frozen(r = l))`.

use super::{Model, unusable_type_name};
use crate::diagnostic::{Bag, Kind, Role, nearest};
use crate::syntax::ast::Name;
use crate::syntax::context::Context;
use crate::vocabulary::PASSES;

impl Model {
    /// Checks the names, and the words of the passes; the entries of passes are formulas, which are checked later.
    pub(super) fn check_variants(&self, context: &Context, bag: &mut Bag) {
        for (at, (name, passes)) in self.variants.iter().enumerate() {
            if let Some(taken) = self.taken_by(at, name, context) {
                let name_clash = Kind::NameClash {
                    name: name.node.clone(),
                    taken,
                };
                bag.push(name.span, name_clash);
            }
            if let Some(kind) = unusable_type_name(&name.node) {
                bag.push(name.span, kind);
            }
            if passes.is_empty() {
                let span = name.span;
                let name = name.node.clone();
                bag.push(span, Kind::NoPass { name });
            }
            for pass in passes {
                if !PASSES.contains(&pass.word.node.as_str()) {
                    let kind = Kind::UnknownPass {
                        name: pass.word.node.clone(),
                        nearest: nearest(&pass.word.node, PASSES.iter().copied()),
                    };
                    bag.push(pass.word.span, kind);
                }
            }
        }
    }

    /// What has the name of the model of this number already.
    fn taken_by(&self, at: usize, name: &Name, context: &Context) -> Option<Role> {
        let mut before = self.variants.iter().take(at);
        if before.any(|(other, _)| other.node == name.node) {
            return Some(Role::Model);
        }
        if self.solver_names.contains(&name.node) {
            return Some(Role::Solver);
        }
        (name.node == context.struct_name).then_some(Role::Struct)
    }
}
