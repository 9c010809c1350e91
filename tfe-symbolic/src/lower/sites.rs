//! Declarations by site of models of run-time length: one formula for all sites of a range.

use super::constraints::{Row, components};
use super::requirements::may_be_below_zero;
use super::{DeclaredPlace, Index, LONGEST_WRITTEN_OUT, Lowerer};
use crate::derive::constraint::{holds_state, holds_velocity, kind, normal};
use crate::diagnostic::Kind;
use crate::expr::graph::{ExprId, SumRange};
use crate::expr::input::{Affine, IndexSymbol};
use crate::model::declared::{Constraint, Extent, Observable};
use crate::syntax::ast::{Expr, Name, Range};

/// What is known about the preceding constraints.
#[derive(Default)]
struct Known {
    constraints: Vec<Constraint>,
    /// The equations without constant factors, and their ranges.
    normals: Vec<(Vec<SumRange>, ExprId)>,
    /// How many rows there are.
    rows: Affine,
}

impl Lowerer<'_> {
    /// The constraints of a model of run-time length.
    pub(super) fn constraints_by_site(&mut self) -> Vec<Constraint> {
        let model = self.model;
        let mut known = Known::default();
        for (name, range, value) in &model.constraints {
            let formula = |lowerer: &mut Self| match range {
                Some(_) => {
                    let one = lowerer.scalar(value).into_iter();
                    one.map(|equation| Row {
                        place: String::new(),
                        value: equation,
                        span: value.span,
                    })
                    .collect()
                }
                None => components(lowerer.value(value), value),
            };
            let Some((ranges, rows)) = self.by_site("constraint", name, range.as_ref(), formula)
            else {
                continue;
            };
            for row in rows {
                if !self.add_by_site((name, value), &ranges, row, &mut known) {
                    break;
                }
            }
        }
        known.constraints
    }

    /// The observables, one number or one for each site.
    pub(super) fn observables(&mut self) -> Vec<Observable> {
        let model = self.model;
        let mut found = Vec::new();
        let mut columns = Affine::default();
        for (name, range, value) in &model.outputs {
            let lowered = match range {
                None => Some((Vec::new(), self.scalar(value))),
                // Reported.
                Some(_) if !self.is_of_run_time_length() => None,
                range => self.by_site("output", name, range.as_ref(), |x| x.scalar(value)),
            };
            let Some((ranges, Some(value_id))) = lowered else {
                continue;
            };
            let Some((column, next)) = numbered(&columns, &ranges) else {
                let number = columns.to_string();
                self.report(value.span, Kind::NumberTooLarge { number });
                continue;
            };
            columns = next;
            found.push(Observable {
                name: name.node.clone(),
                ranges,
                column,
                value: value_id,
            });
        }
        found
    }

    /// Lowers the formula of a declaration with the index of its sites around it; nothing where the range is wrong.
    pub(super) fn by_site<T>(
        &mut self,
        argument: &str,
        name: &Name,
        range: Option<&Range>,
        formula: impl FnOnce(&mut Self) -> T,
    ) -> Option<(Vec<SumRange>, T)> {
        let Some(range) = range else {
            let text = format!("{argument}({name})");
            self.place = Some(DeclaredPlace { text, own: 0 });
            let value = formula(self);
            self.place = None;
            return Some((Vec::new(), value));
        };
        let bounds = (self.affine(&range.start), self.affine(&range.end));
        self.index_name(&range.variable.node, range.variable.span);
        let bounds = self.bounds_without_entries(bounds, (range.start.span, range.end.span));
        let (Some(start), Some(end)) = bounds else {
            return None;
        };
        let whole = range.start.span.join(range.end.span);
        let length = end.plus_scaled(&start, -1);
        if length.is_none_or(|length| length.as_constant().is_some_and(|length| length <= 0)) {
            let range = format!("{}..{}", range.start, range.end);
            self.report(whole, Kind::EmptyRange { range });
            return None;
        }
        if begins_below_zero(&start) {
            let range = format!("{}..{}", range.start, range.end);
            self.report(whole, Kind::SitesBelowZero { range });
            return None;
        }
        let index = &range.variable.node;
        let text = format!("{argument}({name}[{index} in {start}..{end}])");
        self.place = Some(DeclaredPlace { text, own: 1 });
        if may_be_below_zero(&start) {
            // Sites have no index below zero, for small lengths neither.
            self.require_index(&name.node, &start, Extent::Known(end.clone()));
        }
        let variable = self.depth();
        let sites = SumRange {
            variable,
            start: start.clone(),
            end: end.clone(),
        };
        self.indices.push(Index {
            name: index.clone(),
            variable,
            start,
            end,
            offset: Affine::default(),
            at: None,
        });
        match argument {
            "constraint" => self.require_turns(&sites),
            // Without sites, an output has no column.
            _ => self.require_order(&sites),
        }
        let value = formula(self);
        self.indices.pop();
        self.place = None;
        Some((vec![sites], value))
    }

    /// Checks one equation and adds it; whether it was right.
    fn add_by_site(
        &mut self,
        (name, value): (&Name, &Expr),
        ranges: &[SumRange],
        row: Row,
        known: &mut Known,
    ) -> bool {
        let Row {
            place,
            value: row,
            span,
        } = row;
        let own = name.node.clone();
        if self.holds_momentum(row) {
            let span = self.momentum_in(value).unwrap_or(span);
            self.report(span, Kind::MomentumInConstraint);
            return false;
        }
        let Some(row) = self.written_out(row) else {
            let limit = LONGEST_WRITTEN_OUT as usize;
            self.report(span, Kind::SumInConstraint { name: own, limit });
            return false;
        };
        if !holds_state(&self.graph, row) {
            self.report(span, Kind::ConstraintWithoutCoordinate { name: own });
            return false;
        }
        if holds_velocity(&self.graph, row) {
            self.report(span, Kind::VelocityConstraintOfFamily { name: own });
            return false;
        }
        let Some(kind) = kind(&mut self.graph, row) else {
            return false;
        };
        let equation = (ranges.to_vec(), normal(&mut self.graph, row));
        let repeated = known.normals.iter().position(|other| *other == equation);
        let name = format!("{own}{place}");
        let repetition = match (repeated, ranges.first()) {
            (Some(at), _) => Some((name.clone(), known.constraints[at].name.clone())),
            // All sites say the same.
            (None, Some(SumRange { start, end, .. })) if self.graph.loops_of(row) == 0 => {
                let second = start.plus_scaled(&Affine::constant(1), 1);
                let second = second.filter(|second| second != end);
                second.map(|second| (format!("{own}[{second}]"), format!("{own}[{start}]")))
            }
            _ => None,
        };
        if let Some((name, other)) = repetition {
            self.report(span, Kind::RepeatedConstraint { name, other });
            return false;
        }
        let Some((number, next)) = numbered(&known.rows, ranges) else {
            let number = known.rows.to_string();
            self.report(span, Kind::NumberTooLarge { number });
            return false;
        };
        known.rows = next;
        known.normals.push(equation);
        known.constraints.push(Constraint {
            name,
            ranges: ranges.to_vec(),
            row: number,
            kind,
            value: row,
        });
        true
    }
}

/// Whether a range begins below zero, for large lengths at least.
fn begins_below_zero(start: &Affine) -> bool {
    match start.as_constant() {
        Some(start) => start < 0,
        None => start.terms.iter().all(|(_, factor)| *factor < 0),
    }
}

/// The index of what is declared after `first` others, for a declaration by site that of the present site; and their
/// number afterwards.
fn numbered(first: &Affine, ranges: &[SumRange]) -> Option<(Affine, Affine)> {
    match ranges.first() {
        None => Some((first.clone(), first.plus_scaled(&Affine::constant(1), 1)?)),
        Some(sites) => {
            let before = first.plus_scaled(&sites.start, -1)?;
            let site = Affine::symbol(IndexSymbol::Loop(sites.variable));
            let number = before.plus_scaled(&site, 1)?;
            Some((number, before.plus_scaled(&sites.end, 1)?))
        }
    }
}
