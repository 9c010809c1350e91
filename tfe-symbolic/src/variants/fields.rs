//! The fields that a model made from another one still uses.

use crate::expr::graph::{Graph, Node, SumRange};
use crate::expr::input::{Affine, IndexSymbol, Input};
use crate::expr::ordered::SortedSet;
use crate::model::declared::{Declared, Extent, Parameter, Requirement};

/// Keeps what is used: fields (in the order of `fields`, then those added), requirements on their lengths, derivatives by them.
pub(super) fn keep_used(model: &mut Declared, fields: &[String], added: &[(String, String)]) {
    let mut used = Used::default();
    used.formulas(model);
    model.requirements.retain(|requirement| match requirement {
        Requirement::FieldLength { field, .. } => used.0.contains(field),
        // An index of fields that no formula uses any more stands nowhere.
        Requirement::Index { place, length, .. } => match length {
            Extent::OfField(field) => used.0.contains(field) && used.has_fields_of(place),
            Extent::Known(_) => used.has_fields_of(place),
        },
        Requirement::Turns { .. } => true,
    });
    for requirement in &model.requirements {
        used.requirement(requirement);
    }
    let added = added.iter().map(|(name, _)| name);
    let all = fields.iter().chain(added);
    model.used_fields = all.filter(|name| used.0.contains(*name)).cloned().collect();
    let mut parameters = std::mem::take(&mut model.sensitivities);
    parameters.retain(|parameter| {
        used.0.contains(&parameter.field) && !is_in_constraint(model, parameter)
    });
    model.sensitivities = parameters;
}

/// Derivatives of constraints by parameters are not available.
fn is_in_constraint(model: &Declared, parameter: &Parameter) -> bool {
    let is_it = |input: &Input| match input {
        Input::Parameter(name) | Input::ParameterElement(name, _) => *name == parameter.field,
        _ => false,
    };
    let mut values = model.constraints.iter().map(|constraint| constraint.value);
    values.any(|value| model.graph.inputs_of(value).iter().any(is_it))
}

/// Names of fields.
#[derive(Default)]
struct Used(SortedSet<String>);

impl Used {
    fn formulas(&mut self, model: &Declared) {
        let graph = &model.graph;
        let mut roots = vec![model.energy];
        roots.extend(model.dissipation);
        for force in &model.forces {
            roots.push(force.value);
            self.ranges(&force.ranges);
            self.index(&force.target);
        }
        for constraint in &model.constraints {
            roots.push(constraint.value);
            self.ranges(&constraint.ranges);
            self.index(&constraint.row);
        }
        for one in &model.observables {
            roots.push(one.value);
            self.ranges(&one.ranges);
            self.index(&one.column);
        }
        for array in model.coordinates.iter().chain(&model.momenta) {
            self.index(&array.first);
            array.length.iter().for_each(|length| self.index(length));
        }
        self.leaves(graph, &roots);
    }

    fn leaves(&mut self, graph: &Graph, roots: &[crate::expr::graph::ExprId]) {
        for id in graph.reachable(roots) {
            match graph.node(id) {
                Node::Input(input) => {
                    if let Input::Parameter(name) | Input::ParameterElement(name, _) = input {
                        self.0.insert(name.clone());
                    }
                    input
                        .index()
                        .into_iter()
                        .for_each(|index| self.index(index));
                }
                Node::Loop { range, .. } => self.ranges(std::slice::from_ref(range)),
                _ => {}
            }
        }
    }

    fn ranges(&mut self, ranges: &[SumRange]) {
        for range in ranges {
            self.index(&range.start);
            self.index(&range.end);
        }
    }

    fn index(&mut self, index: &Affine) {
        for (symbol, _) in &index.terms {
            match symbol {
                IndexSymbol::Field(name) => {
                    self.0.insert(name.clone());
                }
                IndexSymbol::Entry(list, place) => {
                    self.0.insert(list.clone());
                    self.index(place);
                }
                IndexSymbol::Loop(_) | IndexSymbol::ConstParameter(_) | IndexSymbol::Within(_) => {}
            }
        }
    }

    /// Whether the fields and lists in an index are among them.
    fn has_fields_of(&self, index: &Affine) -> bool {
        index.terms.iter().all(|(symbol, _)| match symbol {
            IndexSymbol::Field(name) => self.0.contains(name),
            IndexSymbol::Entry(list, place) => self.0.contains(list) && self.has_fields_of(place),
            IndexSymbol::Loop(_) | IndexSymbol::ConstParameter(_) | IndexSymbol::Within(_) => true,
        })
    }

    fn requirement(&mut self, requirement: &Requirement) {
        match requirement {
            Requirement::Index {
                nest,
                place,
                length,
                ..
            } => {
                self.ranges(nest);
                self.index(place);
                match length {
                    Extent::Known(length) => self.index(length),
                    Extent::OfField(field) => {
                        self.0.insert(field.clone());
                    }
                }
            }
            Requirement::FieldLength { field, length, .. } => {
                self.0.insert(field.clone());
                self.index(length);
            }
            Requirement::Turns {
                start, end, empty, ..
            } => {
                self.index(start);
                self.index(end);
                empty.iter().flatten().for_each(|place| self.index(place));
            }
        }
    }
}
