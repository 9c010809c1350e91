//! Requests for specialised steppers.

use super::{Model, unusable_type_name};
use crate::diagnostic::{Bag, Kind, Role, nearest};
use crate::model::declared::Solver;
use crate::syntax::ast::{ElementSyntax, Name, Spanned};
use crate::syntax::context::Context;
use crate::vocabulary::element::{Element, Family, Rule};
use crate::vocabulary::{ELEMENTS, MAX_POINTS, RULES};

/// The largest number of nodes of an element.
const MAX_NODES: u32 = 12;

impl Model {
    /// `solver(Name, Mixed::<4>)`
    pub(super) fn solver(
        &mut self,
        name: &Name,
        element: &Spanned<ElementSyntax>,
        context: &Context,
        bag: &mut Bag,
    ) {
        let taken = if self.solver_names.contains(&name.node) {
            Some(Role::Solver)
        } else {
            (name.node == context.struct_name).then_some(Role::Struct)
        };
        if let Some(taken) = taken {
            bag.push(
                name.span,
                Kind::NameClash {
                    name: name.node.clone(),
                    taken,
                },
            );
        }
        if let Some(kind) = unusable_type_name(&name.node) {
            bag.push(name.span, kind);
        }
        self.solver_names.push(name.node.clone());
        let syntax = &element.node;
        let family = Family::named(&syntax.family.node);
        if family.is_none() {
            let kind = Kind::UnknownElement {
                name: syntax.family.node.clone(),
                nearest: nearest(&syntax.family.node, ELEMENTS.iter().copied()),
            };
            bag.push(syntax.family.span, kind);
        }
        let nodes = syntax.nodes.node;
        let count = u32::try_from(nodes).ok();
        let count = count.filter(|count| (2..=MAX_NODES).contains(count));
        if count.is_none() {
            bag.push(syntax.nodes.span, Kind::NodesOutOfRange { nodes });
        }
        let rule = quadrature_rule(syntax, bag);
        // Later steps rely on a valid number of nodes.
        if let (Some(family), Some(rule), Some(nodes)) = (family, rule, count) {
            self.solvers.push(Solver {
                name: name.node.clone(),
                element: Element {
                    family,
                    nodes,
                    rule,
                },
            });
            self.solver_elements
                .push((element.to_string(), element.span));
        }
        self.solver_spans.push(element.span);
    }
}

fn quadrature_rule(syntax: &ElementSyntax, bag: &mut Bag) -> Option<Rule> {
    let Some((name, argument)) = &syntax.rule else {
        return Some(Rule::Default);
    };
    let wrong_arity = |expected: usize| Kind::WrongArity {
        function: name.node.clone(),
        expected,
        found: usize::from(argument.is_some()),
    };
    let only_primal = || Kind::RuleNotForFamily {
        rule: name.node.clone(),
        family: syntax.family.node.clone(),
    };
    let known_family = ELEMENTS.contains(&syntax.family.node.as_str());
    match (name.node.as_str(), argument) {
        ("quadrature", Some(points)) => match u32::try_from(points.node) {
            Ok(count) if (1..=MAX_POINTS).contains(&points.node) => {
                return Some(Rule::Gauss(count));
            }
            _ => bag.push(
                points.span,
                Kind::PointsOutOfRange {
                    points: points.node,
                },
            ),
        },
        ("quadrature", None) => bag.push(name.span, wrong_arity(1)),
        ("reduced" | "lobatto", Some(_)) => bag.push(name.span, wrong_arity(0)),
        ("reduced" | "lobatto", None) if known_family && syntax.family.node != "Primal" => {
            bag.push(name.span, only_primal());
        }
        ("reduced", None) => return Some(Rule::Reduced),
        ("lobatto", None) => return Some(Rule::Lobatto),
        (unknown, _) => {
            let nearest = nearest(unknown, RULES.iter().copied());
            bag.push(
                name.span,
                Kind::UnknownRule {
                    name: unknown.to_owned(),
                    nearest,
                },
            );
        }
    }
    None
}
