//! Requests for specialised steppers.

use super::Model;
use crate::diagnostic::{Bag, Kind, Role, nearest};
use crate::model::declared::{Family, Rule, Solver};
use crate::syntax::ast::{ElementSyntax, Name, Spanned};
use crate::syntax::context::Context;

/// The elements a solver can be specialised for.
pub const ELEMENTS: &[&str] = &["Primal", "Mixed", "ThreeField", "EnergyConserving", "Radau"];
/// The rules of quadrature.
pub const RULES: &[&str] = &["reduced", "lobatto", "quadrature"];
/// The most points a rule can have.
pub const MAX_POINTS: u64 = 24;
/// The most nodes an element can have.
const MAX_NODES: u64 = 12;

impl Model {
    /// `solver(Name, Mixed::<4>)`
    pub(super) fn solver(
        &mut self,
        name: &Name,
        element: &Spanned<ElementSyntax>,
        context: &Context,
        bag: &mut Bag,
    ) {
        let taken = if self.solvers.iter().any(|solver| solver.name == name.node) {
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
        let syntax = &element.node;
        let family = match syntax.family.node.as_str() {
            "Primal" => Some(Family::Primal),
            "Mixed" => Some(Family::Mixed),
            "ThreeField" => Some(Family::ThreeField),
            "EnergyConserving" => Some(Family::EnergyConserving),
            "Radau" => Some(Family::Radau),
            unknown => {
                let nearest = nearest(unknown, ELEMENTS.iter().copied());
                let kind = Kind::UnknownElement {
                    name: unknown.to_owned(),
                    nearest,
                };
                bag.push(syntax.family.span, kind);
                None
            }
        };
        let nodes = syntax.nodes.node;
        if !(2..=MAX_NODES).contains(&nodes) {
            bag.push(syntax.nodes.span, Kind::NodesOutOfRange { nodes });
        }
        let rule = quadrature_rule(syntax, bag);
        if let (Some(family), Some(rule), Ok(nodes)) = (family, rule, u32::try_from(nodes)) {
            self.solvers.push(Solver {
                name: name.node.clone(),
                family,
                nodes,
                rule,
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
