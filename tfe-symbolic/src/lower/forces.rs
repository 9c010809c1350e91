//! Forces on coordinates, and the dissipation.

use super::{DotRule, Index, Lowerer, SHORT_SUM, Setting, Value};
use crate::check::Symbol;
use crate::diagnostic::{Kind, nearest};
use crate::expr::differentiate::derivative;
use crate::expr::graph::{ExprId, Node, SumRange};
use crate::expr::input::{Affine, Input, LoopVariable};
use crate::expr::sorting::sort;
use crate::model::declared::{Force, Form};
use crate::syntax::ast::{Expr, ExprKind};

impl Lowerer<'_> {
    /// `force(target) = value`
    pub(super) fn force(&mut self, target: &Expr, value: &Expr) -> Vec<Force> {
        if let ExprKind::Index {
            value: array,
            index,
        } = &target.node
            && let ExprKind::Name(name) = &array.node
            && let Some((first, length)) = self.coordinate(name)
        {
            let Some(length) = length else {
                self.report(array.span, Kind::VectorExpected);
                return Vec::new();
            };
            return match &index.node {
                ExprKind::Name(index_name) if self.symbol(index_name).is_none() => {
                    self.index_name(index_name, index.span);
                    self.force_on_each(index_name, &first, length, value)
                }
                _ => self.force_on_one((name, index), &first, &length, value),
            };
        }
        let slots = match &target.node {
            ExprKind::Name(name) => self.coordinate(name),
            _ => None,
        };
        let force = |target: Affine, value: ExprId| Force {
            ranges: Vec::new(),
            target,
            value,
        };
        match slots {
            Some((first, None)) => self
                .scalar(value)
                .into_iter()
                .map(|value| force(first.clone(), value))
                .collect(),
            Some((first, Some(_))) => {
                // The whole array; a generic one is reported as in a formula.
                let Value::Vector(targets) = self.value(target) else {
                    return Vec::new();
                };
                let Some(values) = self.vector(value) else {
                    return Vec::new();
                };
                if targets.len() != values.len() {
                    let kind = Kind::WrongLength {
                        expected: targets.len(),
                        found: values.len(),
                    };
                    self.report(value.span, kind);
                    return Vec::new();
                }
                (0..)
                    .zip(values)
                    .filter_map(|(at, value)| {
                        let target = first.plus_scaled(&Affine::constant(at), 1)?;
                        Some(force(target, value))
                    })
                    .collect()
            }
            None => {
                if !self.may_be_missing(target) {
                    let text = target.to_string();
                    let coordinates = self.model.coordinates.iter().map(|slots| &*slots.name.node);
                    let nearest = nearest(&text, coordinates);
                    self.report(
                        target.span,
                        Kind::ForceTarget {
                            target: text,
                            nearest,
                        },
                    );
                }
                self.value(value);
                Vec::new()
            }
        }
    }

    /// Whether a target names something that an argument with a mistake may declare.
    fn may_be_missing(&self, target: &Expr) -> bool {
        let array = match &target.node {
            ExprKind::Index { value, .. } => &value.node,
            node => node,
        };
        self.model.names_missing
            && matches!(array, ExprKind::Name(name) if self.symbol(name).is_none())
    }

    /// The first flat index of a coordinate and the length of an array.
    fn coordinate(&self, name: &str) -> Option<(Affine, Option<Affine>)> {
        match self.symbol(name)? {
            Symbol::Coordinate(at) => {
                let slots = &self.model.coordinates[*at];
                Some((slots.first.clone(), slots.length.clone()))
            }
            _ => None,
        }
    }

    /// `force(q[2]) = value`
    fn force_on_one(
        &mut self,
        (array, index): (&str, &Expr),
        first: &Affine,
        length: &Affine,
        value: &Expr,
    ) -> Vec<Force> {
        let place = self.affine(index);
        let value = self.scalar(value);
        let Some(place) = place else {
            return Vec::new();
        };
        if !self.in_bounds(array, &place, Some(length), index.span) {
            return Vec::new();
        }
        let target = place.plus_scaled(first, 1);
        let (Some(target), Some(value)) = (target, value) else {
            return Vec::new();
        };
        vec![Force {
            ranges: Vec::new(),
            target,
            value,
        }]
    }

    /// `force(q[i]) = value`, `i` over the whole array
    fn force_on_each(
        &mut self,
        index: &str,
        first: &Affine,
        length: Affine,
        value: &Expr,
    ) -> Vec<Force> {
        let variable = self.depth();
        let (start, end) = (Affine::default(), length);
        let range = SumRange {
            variable,
            start: start.clone(),
            end: end.clone(),
        };
        self.indices.push(Index {
            name: index.to_owned(),
            variable,
            start,
            end,
            offset: Affine::default(),
            at: None,
        });
        let value = self.scalar(value);
        self.indices.pop();
        let Some(value) = value else {
            return Vec::new();
        };
        // Written out, ranges that the index moves would look like those that are checked before a run, of which none is empty.
        let stays = self.is_of_run_time_length() && self.moves_a_range(value, variable);
        match range.end.as_constant() {
            Some(length) if length.unsigned_abs() <= SHORT_SUM && !stays => (0..length)
                .filter_map(|at| {
                    let at = Affine::constant(at);
                    let value = self.graph.substitute_loop(value, variable, &at);
                    Some(Force {
                        ranges: Vec::new(),
                        target: first.plus_scaled(&at, 1)?,
                        value,
                    })
                })
                .collect(),
            _ => {
                let index = Affine::symbol(crate::expr::input::IndexSymbol::Loop(variable));
                let target = index.plus_scaled(first, 1).unwrap_or(index);
                vec![Force {
                    ranges: vec![range],
                    target,
                    value,
                }]
            }
        }
    }

    /// Whether the range of a sum in an expression depends on an index.
    fn moves_a_range(&self, value: ExprId, variable: LoopVariable) -> bool {
        let mut nodes = self.graph.reachable(&[value]).into_iter();
        nodes.any(|id| match self.graph.node(id) {
            Node::Loop { range, .. } => {
                range.start.depends_on(variable) || range.end.depends_on(variable)
            }
            _ => false,
        })
    }

    /// `dissipation = value`.
    ///
    /// In a Hamiltonian model the forces −∂D/∂v are made here, with v = ∂H/∂p put in, and there is no
    /// dissipation left to differentiate.
    pub(super) fn dissipation(&mut self, form: Form, value: &Expr) -> (Option<ExprId>, Vec<Force>) {
        let setting = Setting {
            dot: DotRule::Velocity,
            linear_loops: true,
        };
        let dissipation = self.within(setting, |lowerer| lowerer.scalar(value));
        let Some(mut dissipation) = dissipation else {
            return (None, Vec::new());
        };
        let velocity = |input: &Input| matches!(input, Input::Velocity(_));
        let inputs = self.graph.inputs_of(dissipation);
        if !inputs.iter().any(velocity) {
            self.report(value.span, Kind::DissipationWithoutVelocity);
        } else if self.is_linear_in_velocities(dissipation) {
            self.report(value.span, Kind::LinearDissipation);
        }
        if form == Form::Lagrangian {
            return (Some(dissipation), Vec::new());
        }
        let Some(energy) = self.hamiltonian else {
            return (None, Vec::new());
        };
        let flat = (self.written_out(energy), self.written_out(dissipation));
        let (Some(energy), Some(flat)) = flat else {
            self.report(value.span, Kind::VelocityOfLoop);
            return (None, Vec::new());
        };
        dissipation = flat;
        let mut targets: Vec<i64> = self
            .graph
            .inputs_of(dissipation)
            .iter()
            .filter_map(|input| match input {
                Input::Velocity(at) => at.as_constant(),
                _ => None,
            })
            .collect();
        sort(&mut targets);
        let forces = targets.into_iter().map(|at| Force {
            ranges: Vec::new(),
            target: Affine::constant(at),
            value: self.damping(dissipation, at, energy),
        });
        (None, forces.collect())
    }

    /// Whether the derivatives by velocities do not depend on any; not known where there are loops.
    fn is_linear_in_velocities(&mut self, value: ExprId) -> bool {
        if self.graph.contains_sum(value) {
            return false;
        }
        let inputs = self.graph.inputs_of(value).into_iter();
        let velocities: Vec<Input> = inputs
            .filter(|input| matches!(input, Input::Velocity(_)))
            .collect();
        velocities.iter().all(|velocity| {
            let slope = derivative(&mut self.graph, value, velocity);
            let inputs = self.graph.inputs_of(slope);
            !inputs.iter().any(|input| velocities.contains(input))
        })
    }
}
