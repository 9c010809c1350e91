//! Sums over ranges: unrolled where they are short, loops elsewhere.

use super::requirements::may_be_below_zero;
use super::{Index, LONGEST_WRITTEN_OUT, Lowerer, SHORT_SUM, TurnByTurn, Value};
use crate::check::reserved;
use crate::diagnostic::{Kind, Role, Span};
use crate::expr::graph::{ExprId, Node, SumRange};
use crate::expr::input::{Affine, IndexSymbol, LoopVariable};
use crate::syntax::ast::{Expr, Range};

impl Lowerer<'_> {
    pub(super) fn sum(&mut self, range: &Range, body: &Expr) -> Value {
        let whole_range = range;
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
                    if self.indices.iter().any(|index| index.at.is_some()) {
                        // One turn of an outer sum, in which this one is empty.
                        return self.empty_sum(range);
                    }
                    let range = format!("{}..{}", range.start, range.end);
                    self.report(whole, Kind::EmptyRange { range });
                    return Value::Error;
                }
                longest.and_then(|most| u64::try_from(most).ok())
            }
            _ => None,
        };
        let known = bounds.0.is_some() && bounds.1.is_some();
        // After a mistake in a bound, a range that causes no further messages.
        let start = bounds.0.unwrap_or_default();
        let end = bounds
            .1
            .unwrap_or(Affine::symbol(IndexSymbol::Field("…".into())));
        let offset = self.below_zero(&start);
        let from_zero = |bound: Affine| bound.plus_scaled(&offset, -1);
        let (Some(start), Some(end)) = (from_zero(start), from_zero(end)) else {
            let number = range.start.to_string();
            self.report(whole, Kind::NumberTooLarge { number });
            return Value::Error;
        };
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
            offset,
            at: None,
        });
        if known {
            self.require_order(&range);
        }
        let before = self.terms.replace(1);
        let mistakes = self.bag.len();
        let value = self.value(body);
        let terms = count
            .zip(self.terms)
            .and_then(|(count, inner)| count.checked_mul(inner));
        self.terms = before.zip(terms).map(|(before, terms)| before.max(terms));
        let index = self.indices.pop();
        if !known {
            return Value::Error;
        }
        if let Value::Vector(components) = &value {
            let span = whole_range.variable.span;
            self.vector_sums.insert(span, components.len());
        }
        if let Some(pending) = self.turn_by_turn.take() {
            self.terms = before;
            if self.bag.len() > mistakes {
                return Value::Error;
            }
            let own = pending.variables.contains(&range.variable);
            let bounds = (range.start.as_constant(), range.end.as_constant());
            let (Some(mut index), (Some(start), Some(end)), true) = (index, bounds, own) else {
                // The sum to be unrolled is further outside.
                self.turn_by_turn = Some(pending);
                return Value::Error;
            };
            return self.each_turn((start, end), &mut index, body);
        }
        match value {
            Value::Scalar(id) => Value::Scalar(self.sum_of(range, id, terms)),
            Value::Vector(components) => self.each(components, |lowerer, id| {
                Some(lowerer.sum_of(range.clone(), id, terms))
            }),
            Value::Error => Value::Error,
        }
    }

    /// The smallest value of a bound where it is negative, or may be for some lengths; otherwise zero.
    fn below_zero(&self, bound: &Affine) -> Affine {
        let least = self.extreme(bound, false).unwrap_or_default();
        match least.as_constant() {
            Some(least) => Affine::constant(least.min(0)),
            None if may_be_below_zero(&least) => least,
            None => Affine::default(),
        }
    }

    /// A sum over a literal range, lowered anew for each value of its index.
    fn each_turn(&mut self, (first, end): (i64, i64), index: &mut Index, body: &Expr) -> Value {
        let mut total: Option<Value> = None;
        for turn in first..end {
            let here = Affine::constant(turn);
            let value = index.offset.plus_scaled(&here, 1);
            index.at = Some(value.unwrap_or(here));
            index.start = Affine::constant(turn);
            index.end = Affine::constant(turn + 1);
            self.indices.push(index.clone());
            let value = self.value(body);
            self.indices.pop();
            total = match (total, value) {
                (_, Value::Error) => return Value::Error,
                (None, value) => Some(value),
                (Some(Value::Scalar(sum)), Value::Scalar(value)) => {
                    Some(Value::Scalar(self.graph.add(sum, value)))
                }
                (Some(Value::Vector(sum)), Value::Vector(value)) => {
                    let pairs = sum.into_iter().zip(value);
                    let added = pairs.map(|(a, b)| self.graph.add(a, b));
                    Some(Value::Vector(added.collect()))
                }
                // The same formula gives values of the same shape.
                (Some(_), _) => return Value::Error,
            };
        }
        total.unwrap_or_else(|| Value::Scalar(self.graph.integer(0)))
    }

    /// Zero, or a vector of zeros where the sum is one of vectors.
    fn empty_sum(&mut self, range: &Range) -> Value {
        let zero = self.graph.integer(0);
        match self.vector_sums.get(&range.variable.span) {
            Some(length) => Value::Vector(vec![zero; *length]),
            None => Value::Scalar(zero),
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

    /// The unrolled expression, if its loops are short enough.
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

    /// In an energy: the expression without loops, because it is used nonlinearly.
    pub(super) fn no_loop(&mut self, id: ExprId, span: Span) -> Option<ExprId> {
        if !self.setting.linear_loops || !self.graph.contains_sum(id) {
            return Some(id);
        }
        let written_out = self.written_out(id);
        if written_out.is_none() {
            self.cannot_be_written_out(&[id], span);
        }
        written_out
    }

    /// Requests another attempt in which outer sums are unrolled turn by turn, if that makes the ranges of these sums
    /// literal; otherwise reports it.
    pub(super) fn cannot_be_written_out(&mut self, sums: &[ExprId], span: Span) {
        match self.sums_around(sums) {
            Some(variables) => {
                let pending = self.turn_by_turn.get_or_insert(TurnByTurn {
                    variables: Vec::new(),
                    span,
                });
                pending.variables.extend(variables);
            }
            None => self.nonlinear_sum(span),
        }
    }

    /// The indices around on which the ranges of sums depend, where all those ranges are literal but for these indices and short.
    fn sums_around(&self, sums: &[ExprId]) -> Option<Vec<LoopVariable>> {
        let mut bounds: Vec<&Affine> = Vec::new();
        let mut terms = 1;
        for id in self.graph.reachable(sums) {
            if let Node::Loop { range, .. } = self.graph.node(id) {
                bounds.extend([&range.start, &range.end]);
            }
            if let Some(count) = self.loops.get(&id) {
                terms = terms.max((*count)?);
            }
        }
        let mut needed = Vec::new();
        while let Some(bound) = bounds.pop() {
            let is_loop = |(symbol, _): &(IndexSymbol, i64)| matches!(symbol, IndexSymbol::Loop(_));
            if !bound.terms.iter().all(is_loop) {
                return None;
            }
            for variable in bound.variables() {
                let around = |index: &&Index| index.variable == variable && index.at.is_none();
                let Some(index) = self.indices.iter().find(around) else {
                    continue;
                };
                if !needed.contains(&variable) {
                    needed.push(variable);
                    bounds.extend([&index.start, &index.end]);
                    let length = index.end.plus_scaled(&index.start, -1)?;
                    let most = self.extreme(&length, true)?.as_constant()?;
                    terms = terms.checked_mul(u64::try_from(most).ok()?)?;
                }
            }
        }
        (!needed.is_empty() && terms <= LONGEST_WRITTEN_OUT).then_some(needed)
    }
}
