//! The parameters of `sensitivity(…)`: fields of type `f64` and elements of array fields.
//!
//! Naming a field here does not count as a use: a field that no formula contains is still reported as unused.

use super::Lowerer;
use crate::check::Symbol;
use crate::diagnostic::{Kind, Span, nearest};
use crate::expr::input::{Affine, IndexSymbol};
use crate::model::declared::{Constraint, Parameter};
use crate::syntax::ast::{Expr, ExprKind};
use crate::syntax::context::{FieldKind, Length};

impl Lowerer<'_> {
    pub(super) fn sensitivities(&mut self, constraints: &[Constraint]) -> Vec<Parameter> {
        let model = self.model;
        let mut parameters: Vec<Parameter> = Vec::new();
        for expr in &model.sensitivities {
            let Some(parameter) = self.parameter(expr) else {
                continue;
            };
            if parameters.contains(&parameter) {
                let name = parameter.to_string();
                self.report(expr.span, Kind::RepeatedParameter { name });
            } else if let Some(constraint) = self.constraint_with(&parameter, constraints) {
                let kind = Kind::ParameterOfConstraint {
                    name: parameter.to_string(),
                    constraint: constraint.name.clone(),
                };
                self.report(expr.span, kind);
            } else {
                parameters.push(parameter);
            }
        }
        parameters
    }

    fn parameter(&mut self, expr: &Expr) -> Option<Parameter> {
        match &expr.node {
            ExprKind::Name(name) => match self.parameter_field(name, expr.span)? {
                FieldKind::Scalar => Some(Parameter {
                    field: name.clone(),
                    element: None,
                }),
                FieldKind::Array(_) | FieldKind::Vector => {
                    let name = name.clone();
                    self.report(expr.span, Kind::ArrayOfParameters { name });
                    None
                }
                FieldKind::Length | FieldKind::Indices | FieldKind::Other(_) => {
                    self.not_a_parameter(expr)
                }
            },
            ExprKind::Index { value, index } => match &value.node {
                ExprKind::Name(name) => self.parameter_element(name, value.span, index, expr),
                _ => self.not_a_parameter(expr),
            },
            ExprKind::Error => None,
            _ => self.not_a_parameter(expr),
        }
    }

    /// `k[2]`
    fn parameter_element(
        &mut self,
        name: &str,
        span: Span,
        index: &Expr,
        whole: &Expr,
    ) -> Option<Parameter> {
        let length = match self.parameter_field(name, span)? {
            // No elements: reported where it is declared.
            FieldKind::Array(Length::Literal(0)) => return None,
            FieldKind::Array(Length::Literal(length)) => {
                Some(Affine::constant(i64::try_from(length).unwrap_or(i64::MAX)))
            }
            FieldKind::Array(Length::ConstParameter(name)) => {
                Some(Affine::symbol(IndexSymbol::ConstParameter(name)))
            }
            FieldKind::Vector => None,
            _ => return self.not_a_parameter(whole),
        };
        if holds_name(index) {
            let kind = Kind::IndexNotLiteral {
                array: name.to_owned(),
                index: index.to_string(),
            };
            self.report(index.span, kind);
            return None;
        }
        let place = self.affine(index)?;
        if !self.in_bounds(name, &place, length.as_ref(), index.span) {
            return None;
        }
        Some(Parameter {
            field: name.to_owned(),
            element: Some(usize::try_from(place.as_constant()?).ok()?),
        })
    }

    /// The type of the field of this name; a name of anything else is a mistake.
    fn parameter_field(&mut self, name: &str, span: Span) -> Option<FieldKind> {
        let kind = match self.symbol(name) {
            Some(Symbol::Field(at)) => return Some(self.context.fields[*at].kind.clone()),
            Some(symbol) => Kind::NotAParameter {
                target: name.to_owned(),
                role: Some(symbol.role()),
            },
            None if matches!(name, "t" | "pi") => Kind::NotAParameter {
                target: name.to_owned(),
                role: None,
            },
            // It may be what could not be read.
            None if self.model.names_missing => return None,
            None => {
                let fields = self.context.fields.iter();
                let numbers = fields.filter(|field| {
                    !matches!(
                        field.kind,
                        FieldKind::Length | FieldKind::Indices | FieldKind::Other(_)
                    )
                });
                Kind::UnknownParameter {
                    name: name.to_owned(),
                    nearest: nearest(name, numbers.map(|field| &*field.name)),
                }
            }
        };
        self.report(span, kind);
        None
    }

    fn not_a_parameter(&mut self, expr: &Expr) -> Option<Parameter> {
        let (target, role) = (expr.to_string(), None);
        self.report(expr.span, Kind::NotAParameter { target, role });
        None
    }
}

/// Whether an index mentions anything but numbers.
fn holds_name(index: &Expr) -> bool {
    matches!(index.node, ExprKind::Name(_)) || index.children().into_iter().any(holds_name)
}
