//! Constraints: one scalar equation for each row, and the kind of each.

use super::{DotRule, Index, LONGEST_WRITTEN_OUT, Lowerer, Setting, Value};
use crate::check::Symbol;
use crate::derive::constraint::{holds_state, is_affine, kind, normal};
use crate::diagnostic::{Kind, Span};
use crate::expr::graph::ExprId;
use crate::expr::input::{Affine, Input};
use crate::model::declared::{Constraint, ConstraintKind, Parameter};
use crate::syntax::ast::{Expr, ExprKind, Name, Range};

/// One scalar equation of a declaration.
pub(super) struct Row {
    /// What follows the name: nothing, `[2]`, `[2][0]`.
    pub(super) place: String,
    pub(super) value: ExprId,
    /// Where it stands.
    pub(super) span: Span,
}

/// What is known about the preceding constraints.
#[derive(Default)]
struct Known {
    constraints: Vec<Constraint>,
    /// The equations without constant factors.
    normals: Vec<ExprId>,
}

impl Lowerer<'_> {
    pub(super) fn constraints(&mut self) -> Vec<Constraint> {
        let setting = Setting {
            dot: DotRule::Velocity,
            linear_loops: false,
        };
        if self.is_of_run_time_length() {
            return self.within(setting, Self::constraints_by_site);
        }
        let model = self.model;
        let mut known = Known::default();
        for (name, range, value) in &model.constraints {
            let rows = self.within(setting, |lowerer| lowerer.rows(range.as_ref(), value));
            self.judge((name, range.is_some(), value), rows, &mut known);
        }
        known.constraints
    }

    /// The equations of one declaration.
    fn rows(&mut self, range: Option<&Range>, value: &Expr) -> Vec<Row> {
        match range {
            None => {
                let result = self.value(value);
                components(result, value)
            }
            Some(range) => self.family(range, value),
        }
    }

    /// `constraint(name[i in a..b]) = value`
    fn family(&mut self, range: &Range, value: &Expr) -> Vec<Row> {
        let bounds = (self.affine(&range.start), self.affine(&range.end));
        self.index_name(&range.variable.node, range.variable.span);
        let whole = range.start.span.join(range.end.span);
        let text = format!("{}..{}", range.start, range.end);
        let (Some(start), Some(end)) = bounds else {
            return Vec::new();
        };
        let turns = self.turns((&start, &end), text, whole);
        let variable = self.depth();
        self.indices.push(Index {
            name: range.variable.node.clone(),
            variable,
            start,
            end,
            offset: Affine::default(),
            at: None,
        });
        let result = self.value(value);
        self.indices.pop();
        let mut rows = Vec::new();
        for at in turns {
            for row in components(result.clone(), value) {
                let index = Affine::constant(at);
                let place = format!("[{at}]{}", row.place);
                let value = self.graph.substitute_loop(row.value, variable, &index);
                rows.push(Row {
                    place,
                    value,
                    ..row
                });
            }
        }
        rows
    }

    /// The values of the index of a family.
    fn turns(
        &mut self,
        (start, end): (&Affine, &Affine),
        range: String,
        whole: Span,
    ) -> std::ops::Range<i64> {
        let kind = match (start.as_constant(), end.as_constant()) {
            (Some(start), Some(end)) if end <= start => Kind::EmptyRange { range },
            (Some(start), Some(end)) if end.abs_diff(start) > LONGEST_WRITTEN_OUT => {
                let limit = LONGEST_WRITTEN_OUT as usize;
                Kind::TooManyConstraints { limit }
            }
            (Some(start), Some(end)) => return start..end,
            _ => Kind::ConstraintRange { range },
        };
        self.report(whole, kind);
        0..0
    }

    /// Checks the equations of one declaration.
    fn judge(
        &mut self,
        (name, family, value): (&Name, bool, &Expr),
        rows: Vec<Row>,
        known: &mut Known,
    ) {
        for Row {
            place,
            value: row,
            span,
        } in rows
        {
            let own = || name.node.clone();
            if self.holds_momentum(row) {
                let span = self.momentum_in(value).unwrap_or(span);
                self.report(span, Kind::MomentumInConstraint);
                return;
            }
            if let Some(name) = self.input_in(row) {
                let constraint = own();
                self.report(span, Kind::InputOfConstraint { name, constraint });
                return;
            }
            let Some(row) = self.written_out(row) else {
                let (name, limit) = (own(), LONGEST_WRITTEN_OUT as usize);
                self.report(span, Kind::SumInConstraint { name, limit });
                return;
            };
            if !holds_state(&self.graph, row) {
                self.report(span, Kind::ConstraintWithoutCoordinate { name: own() });
                return;
            }
            let Some(kind) = kind(&mut self.graph, row) else {
                // Parts of a family's value contain its index, which has a meaning only there.
                let part = (!family).then(|| self.not_affine_in(value)).flatten();
                let span = part.unwrap_or(span);
                self.report(span, Kind::ConstraintNotAffine { name: own() });
                return;
            };
            let normal = normal(&mut self.graph, row);
            let name_of_row = format!("{}{place}", name.node);
            if let Some(at) = known.normals.iter().position(|other| *other == normal) {
                let other = known.constraints[at].name.clone();
                let name = name_of_row;
                self.report(span, Kind::RepeatedConstraint { name, other });
                return;
            }
            known.normals.push(normal);
            known.constraints.push(Constraint {
                name: name_of_row,
                ranges: Vec::new(),
                row: Affine::constant(known.constraints.len() as i64),
                kind,
                value: row,
            });
        }
    }

    pub(super) fn holds_momentum(&self, id: ExprId) -> bool {
        let momentum = |input: &Input| matches!(input, Input::Momentum(_));
        self.graph.inputs_of(id).iter().any(momentum)
    }

    /// An input that a value holds.
    fn input_in(&self, id: ExprId) -> Option<String> {
        let inputs = self.graph.inputs_of(id);
        inputs.into_iter().find_map(|input| match input {
            Input::Control(name) => Some(name),
            _ => None,
        })
    }

    /// The first name that stands for a momentum, or for a `let` that holds one.
    pub(super) fn momentum_in(&self, expr: &Expr) -> Option<Span> {
        self.momentum_beside(expr, &mut vec![false; self.model.lets.len()])
    }

    /// The same, without `let`s in which none has been found.
    fn momentum_beside(&self, expr: &Expr, without: &mut [bool]) -> Option<Span> {
        if let ExprKind::Name(name) = &expr.node
            && self.index(name).is_none()
        {
            return match self.symbol(name)? {
                Symbol::Momentum(_) => Some(expr.span),
                Symbol::Let(at) => {
                    let at = *at;
                    if std::mem::replace(without.get_mut(at)?, true) {
                        return None;
                    }
                    let (_, value) = self.model.lets.get(at)?;
                    self.momentum_beside(value, without).map(|_| expr.span)
                }
                _ => None,
            };
        }
        let mut children = expr.children().into_iter();
        children.find_map(|child| self.momentum_beside(child, without))
    }

    /// The smallest part of an expression without sums that is not affine in the velocities.
    fn not_affine_in(&mut self, expr: &Expr) -> Option<Span> {
        let setting = Setting {
            dot: DotRule::Velocity,
            linear_loops: false,
        };
        let mut guilty = None;
        let mut waiting = vec![expr];
        while let Some(part) = waiting.pop() {
            // What stands under an index or a sum has a meaning there only.
            if matches!(part.node, ExprKind::Index { .. } | ExprKind::Sum { .. }) {
                continue;
            }
            let value = self.within(setting, |lowerer| lowerer.value(part));
            let values = match value {
                Value::Scalar(id) => vec![id],
                Value::Vector(ids) => ids,
                Value::Error => return guilty,
            };
            if values.into_iter().any(|id| !is_affine(&mut self.graph, id)) {
                guilty = Some(part.span);
                waiting = part.children();
                waiting.reverse();
            }
        }
        guilty
    }

    /// Refuses solvers whose elements cannot enforce the constraints.
    pub(super) fn check_solvers(&mut self, constraints: &[Constraint]) {
        // Solvers of a model of run-time length have been reported.
        if constraints.is_empty() || self.is_of_run_time_length() {
            return;
        }
        let velocity = constraints
            .iter()
            .any(|constraint| matches!(constraint.kind, ConstraintKind::Velocity { .. }));
        let model = self.model;
        for (solver, (element, span)) in model.solvers.iter().zip(&model.solver_elements) {
            if !solver.element.holds(velocity) {
                let kind = Kind::SolverOfConstraints {
                    element: element.clone(),
                    nodes: solver.element.nodes,
                    velocity: velocity && solver.element.family.is_by_displacements(),
                };
                self.report(*span, kind);
            }
        }
    }

    /// The constraint that a parameter appears in.
    pub(super) fn constraint_with<'a>(
        &self,
        parameter: &Parameter,
        constraints: &'a [Constraint],
    ) -> Option<&'a Constraint> {
        let is_it = |input: &Input| match input {
            Input::Parameter(name) => *name == parameter.field && parameter.element.is_none(),
            Input::ParameterElement(name, at) => {
                let element = at.as_constant().map(usize::try_from);
                *name == parameter.field
                    && element.is_none_or(|element| element.ok() == parameter.element)
            }
            _ => false,
        };
        constraints
            .iter()
            .find(|constraint| self.graph.inputs_of(constraint.value).iter().any(is_it))
    }
}

/// The equations of a value: one, or one for each component.
pub(super) fn components(value: Value, expr: &Expr) -> Vec<Row> {
    match value {
        Value::Scalar(value) => vec![Row {
            place: String::new(),
            value,
            span: expr.span,
        }],
        Value::Vector(values) => {
            let parts = match &expr.node {
                ExprKind::Vector(parts) => parts.as_slice(),
                _ => &[],
            };
            let row = |(at, value): (usize, ExprId)| Row {
                place: format!("[{at}]"),
                value,
                span: parts.get(at).map_or(expr.span, |part| part.span),
            };
            values.into_iter().enumerate().map(row).collect()
        }
        Value::Error => Vec::new(),
    }
}
