//! Models made from the declared one: `model(Name, truncated(2), frozen(r = l))`.

use super::Model;
use crate::diagnostic::{Bag, Kind, Role, nearest};
use crate::syntax::ast::Name;
use crate::syntax::context::Context;

/// What can be done to a model.
pub const PASSES: &[&str] = &["truncated", "frozen", "routh", "rigid", "elastic"];

impl Model {
    /// Names, and the words of the passes; their entries are formulas.
    pub(super) fn check_variants(&self, context: &Context, bag: &mut Bag) {
        for (at, (name, passes)) in self.variants.iter().enumerate() {
            if let Some(taken) = self.taken_by(at, name, context) {
                let name_clash = Kind::NameClash {
                    name: name.node.clone(),
                    taken,
                };
                bag.push(name.span, name_clash);
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
        let mut solvers = self.solvers.iter();
        if solvers.any(|solver| solver.name == name.node) {
            return Some(Role::Solver);
        }
        (name.node == context.struct_name).then_some(Role::Struct)
    }
}
