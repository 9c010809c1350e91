//! Sums over ranges: written out where short, loops elsewhere.

use super::{Index, LONGEST_WRITTEN_OUT, Lowerer, SHORT_SUM, Value};
use crate::check::reserved;
use crate::diagnostic::{Kind, Role, Span};
use crate::expr::graph::{ExprId, SumRange};
use crate::expr::input::{Affine, IndexSymbol};
use crate::syntax::ast::{Expr, Range};

impl Lowerer<'_> {
    pub(super) fn sum(&mut self, range: &Range, body: &Expr) -> Value {
        let bounds = (self.affine(&range.start), self.affine(&range.end));
        self.index_name(&range.variable.node, range.variable.span);
        let whole = range.start.span.join(range.end.span);
        let bounds = self.bounds_without_entries(bounds, (range.start.span, range.end.span));
        let count = match &bounds {
            (Some(start), Some(end)) => {
                let Some(length) = end.plus_scaled(start, -1) else {
                    self.report(
                        whole,
                        Kind::NumberTooLarge {
                            number: range.end.to_string(),
                        },
                    );
                    return Value::Error;
                };
                let longest = self
                    .extreme(&length, true)
                    .and_then(|most| most.as_constant());
                if longest.is_some_and(|most| most <= 0) {
                    let range = format!("{}..{}", range.start, range.end);
                    self.report(whole, Kind::EmptyRange { range });
                    return Value::Error;
                }
                longest.and_then(|most| u64::try_from(most).ok())
            }
            _ => None,
        };
        let known = bounds.0.is_some() && bounds.1.is_some();
        // After a mistake in a bound, a range that provokes no further ones.
        let start = bounds.0.unwrap_or_default();
        let end = bounds
            .1
            .unwrap_or(Affine::symbol(IndexSymbol::Field("…".into())));
        let variable = self.depth();
        let (name, range) = (
            range.variable.node.clone(),
            SumRange {
                variable,
                start,
                end,
            },
        );
        let (start, end) = (range.start.clone(), range.end.clone());
        self.indices.push(Index {
            name,
            variable,
            start,
            end,
        });
        if known {
            self.require_turns(&range);
        }
        let before = self.terms.replace(1);
        let value = self.value(body);
        let terms = count
            .zip(self.terms)
            .and_then(|(count, inner)| count.checked_mul(inner));
        self.terms = before.zip(terms).map(|(before, terms)| before.max(terms));
        self.indices.pop();
        if !known {
            return Value::Error;
        }
        match value {
            Value::Scalar(id) => Value::Scalar(self.sum_of(range, id, terms)),
            Value::Vector(components) => self.each(components, |lowerer, id| {
                Some(lowerer.sum_of(range.clone(), id, terms))
            }),
            Value::Error => Value::Error,
        }
    }

    /// The bounds of a range, of which neither may come from a list.
    pub(super) fn bounds_without_entries(
        &mut self,
        (start, end): (Option<Affine>, Option<Affine>),
        (start_span, end_span): (Span, Span),
    ) -> (Option<Affine>, Option<Affine>) {
        let mut plain = |bound: Option<Affine>, span| {
            let bound = bound?;
            let list = bound.entries().next().map(|(list, _)| list.to_owned());
            match list {
                None => Some(bound),
                Some(list) => {
                    self.report(span, Kind::ListInRange { list });
                    None
                }
            }
        };
        (plain(start, start_span), plain(end, end_span))
    }

    fn sum_of(&mut self, range: SumRange, body: ExprId, terms: Option<u64>) -> ExprId {
        let sum = self.graph.sum(range, body);
        if terms.is_some_and(|terms| terms <= SHORT_SUM)
            && let Ok(written_out) = self.graph.unroll(sum)
        {
            return written_out;
        }
        for id in self.graph.reachable(&[sum]) {
            // The simplifier may have split the sum or pulled factors out of it.
            if self.graph.contains_sum(id) {
                self.loops.entry(id).or_insert(terms);
            }
        }
        sum
    }

    /// Checks the name of an index.
    pub(super) fn index_name(&mut self, name: &str, span: Span) {
        let taken = if self.index(name).is_some() {
            Some(Role::Index)
        } else {
            self.model.symbols.get(name).map(crate::check::Symbol::role)
        };
        if let Some(kind) = reserved(name, false).filter(|_| name != "_") {
            self.report(span, kind);
        } else if let Some(taken) = taken {
            self.report(
                span,
                Kind::NameClash {
                    name: name.to_owned(),
                    taken,
                },
            );
        }
    }

    /// The expression without loops, if they are short enough to be written out.
    pub(super) fn written_out(&mut self, id: ExprId) -> Option<ExprId> {
        let terms = self
            .graph
            .reachable(&[id])
            .into_iter()
            .filter_map(|id| self.loops.get(&id));
        let short = |terms: &Option<u64>| terms.is_some_and(|terms| terms <= LONGEST_WRITTEN_OUT);
        if !terms.into_iter().all(short) {
            return None;
        }
        let written_out = self.graph.unroll(id).ok()?;
        (!self.graph.contains_sum(written_out)).then_some(written_out)
    }

    pub(super) fn nonlinear_sum(&mut self, span: Span) {
        self.report(
            span,
            Kind::NonlinearSum {
                limit: LONGEST_WRITTEN_OUT as usize,
            },
        );
    }

    /// In an energy: the expression without loops, because something nonlinear is made of it.
    pub(super) fn no_loop(&mut self, id: ExprId, span: Span) -> Option<ExprId> {
        if !self.setting.linear_loops || !self.graph.contains_sum(id) {
            return Some(id);
        }
        let written_out = self.written_out(id);
        if written_out.is_none() {
            self.nonlinear_sum(span);
        }
        written_out
    }
}
