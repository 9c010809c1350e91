//! Indices: affine arithmetic on the syntax, and the range of values of an index.

use super::{Index, Lowerer};
use crate::check::Symbol;
use crate::diagnostic::{Kind, Span};
use crate::expr::input::{Affine, IndexSymbol};
use crate::model::declared::Extent;
use crate::syntax::ast::{BinaryOperator, Expr, ExprKind};
use crate::syntax::context::FieldKind;

/// The number of turns of a nest of loops that are examined before an index is assumed to stay inside its array.
const TRIPS: u64 = 20_000;

impl Lowerer<'_> {
    /// An index or a bound: integers, lengths and multiples of indices.
    pub(super) fn affine(&mut self, expr: &Expr) -> Option<Affine> {
        let not_affine = || Kind::IndexNotAffine {
            index: expr.to_string(),
        };
        let not_integer = || Kind::IndexNotInteger {
            index: expr.to_string(),
        };
        let result = match &expr.node {
            ExprKind::Number(text) => {
                let digits = text.replace('_', "");
                if !digits.bytes().all(|byte| byte.is_ascii_digit()) {
                    self.report(expr.span, not_integer());
                    return None;
                }
                digits.parse().ok().map(Affine::constant)
            }
            ExprKind::Name(name) => return self.index_symbol(name, expr),
            ExprKind::Index { value, index } => {
                if let ExprKind::Name(list) = &value.node
                    && self.index(list).is_none()
                    && self.is_list(list)
                {
                    return self.entry_of_list(list, index);
                }
                self.report(expr.span, not_integer());
                return None;
            }
            ExprKind::Negate(value) => Affine::default().plus_scaled(&self.affine(value)?, -1),
            ExprKind::Binary {
                operator,
                left,
                right,
            } => {
                let operands = (self.affine(left), self.affine(right));
                let (Some(left), Some(right)) = operands else {
                    return None;
                };
                match operator {
                    BinaryOperator::Add => left.plus_scaled(&right, 1),
                    BinaryOperator::Subtract => left.plus_scaled(&right, -1),
                    BinaryOperator::Multiply => match (left.as_constant(), right.as_constant()) {
                        (Some(factor), _) => Affine::default().plus_scaled(&right, factor),
                        (_, Some(factor)) => Affine::default().plus_scaled(&left, factor),
                        _ => {
                            self.report(expr.span, not_affine());
                            return None;
                        }
                    },
                    BinaryOperator::Divide | BinaryOperator::Power => {
                        self.report(expr.span, not_affine());
                        return None;
                    }
                }
            }
            ExprKind::Error => return None,
            _ => {
                self.report(expr.span, not_integer());
                return None;
            }
        };
        if result.is_none() {
            self.report(
                expr.span,
                Kind::NumberTooLarge {
                    number: expr.to_string(),
                },
            );
        }
        result
    }

    fn index_symbol(&mut self, name: &str, expr: &Expr) -> Option<Affine> {
        if let Some(index) = self.index(name) {
            return Some(index.value());
        }
        let symbol = match self.symbol(name) {
            Some(Symbol::ConstParameter) => IndexSymbol::ConstParameter(name.to_owned()),
            Some(Symbol::Field(at)) if self.context.fields[*at].kind == FieldKind::Length => {
                IndexSymbol::Field(name.to_owned())
            }
            Some(_) => {
                self.report(
                    expr.span,
                    Kind::IndexNotInteger {
                        index: name.to_owned(),
                    },
                );
                return None;
            }
            None if matches!(name, "t" | "pi") => {
                self.report(
                    expr.span,
                    Kind::IndexNotInteger {
                        index: name.to_owned(),
                    },
                );
                return None;
            }
            None => {
                self.unknown(name, expr.span);
                return None;
            }
        };
        self.use_symbol(&symbol);
        Some(Affine::symbol(symbol))
    }

    /// Whether a name is that of a list of indices.
    pub(super) fn is_list(&self, name: &str) -> bool {
        let Some(Symbol::Field(at)) = self.symbol(name) else {
            return false;
        };
        self.context.fields[*at].kind == FieldKind::Indices
    }

    /// `left[k]`; the list has to be as long as its largest index requires.
    pub(super) fn entry_of_list(&mut self, list: &str, index: &Expr) -> Option<Affine> {
        self.use_symbol(&IndexSymbol::Field(list.to_owned()));
        let place = self.affine(index)?;
        if place.holds_entry() {
            let text = index.to_string();
            self.report(index.span, Kind::IndexNotAffine { index: text });
            return None;
        }
        if !self.in_bounds(list, &place, None, index.span) {
            return None;
        }
        self.require_length(list, &place);
        Some(Affine::symbol(IndexSymbol::Entry(list.to_owned(), place)))
    }

    /// The largest or smallest value over the ranges of all indices in scope, as far as the ranges are independent of
    /// each other; `None` on overflow.
    pub(super) fn extreme(&self, affine: &Affine, largest: bool) -> Option<Affine> {
        let mut value = affine.clone();
        for Index {
            variable,
            start,
            end,
            ..
        } in self.indices.iter().rev()
        {
            let symbol = IndexSymbol::Loop(*variable);
            let coefficient = coefficient(&value, &symbol);
            if coefficient != 0 {
                let last = end.plus_scaled(&Affine::constant(1), -1)?;
                let bound = if (coefficient > 0) == largest {
                    &last
                } else {
                    start
                };
                value = value
                    .plus_scaled(&Affine::symbol(symbol), coefficient.checked_neg()?)?
                    .plus_scaled(bound, coefficient)?;
            }
        }
        Some(value)
    }

    /// The smallest and largest value where both are numbers.
    pub(super) fn extent(&self, affine: &Affine) -> Option<(i64, i64)> {
        let low = self.extreme(affine, false)?.as_constant()?;
        let high = self.extreme(affine, true)?.as_constant()?;
        Some((low, high))
    }

    /// Whether an index stays inside an array (if its length is unknown here: whether it is not negative), as far as
    /// that can be decided; if it does not, this is reported.
    pub(super) fn in_bounds(
        &mut self,
        array: &str,
        place: &Affine,
        length: Option<&Affine>,
        span: Span,
    ) -> bool {
        // The entries of a list are known only at run time.
        if place.holds_entry() {
            let length = match length {
                Some(length) => Extent::Known(length.clone()),
                None => Extent::OfField(array.to_owned()),
            };
            self.require_index(array, place, length);
            return true;
        }
        let extremes = (self.extreme(place, false), self.extreme(place, true));
        let (Some(low), Some(high)) = extremes else {
            self.report(
                span,
                Kind::NumberTooLarge {
                    number: place.to_string(),
                },
            );
            return false;
        };
        let beyond = length.map_or(Some(Affine::constant(-1)), |end| high.plus_scaled(end, -1));
        let Some(beyond) = beyond else {
            self.report(
                span,
                Kind::NumberTooLarge {
                    number: place.to_string(),
                },
            );
            return false;
        };
        if is_inside(&low, &beyond) {
            return true;
        }
        let Some(side) = self.always_outside(place, length) else {
            if let Some(length) = length {
                self.require_index(array, place, Extent::Known(length.clone()));
            }
            return true;
        };
        // An extreme value is a clearer message than the index itself, if it is attained.
        let value = if side == Side::Above { high } else { low };
        let length = length.map(Affine::to_string);
        let array = array.to_owned();
        let (value, ranges) = (value.to_string(), self.ranges_of(place));
        self.report(
            span,
            Kind::IndexOutOfRange {
                array,
                value,
                length,
                ranges,
            },
        );
        false
    }

    /// Whether the ranges around show an index to stay inside an array.
    pub(super) fn stays_inside(&self, place: &Affine, length: &Affine) -> bool {
        let low = self.extreme(place, false);
        let beyond = self
            .extreme(place, true)
            .and_then(|high| high.plus_scaled(length, -1));
        low.zip(beyond)
            .is_some_and(|(low, beyond)| is_inside(&low, &beyond))
    }

    /// The ranges that an index depends on, as the user wrote them.
    pub(super) fn ranges_of(&self, place: &Affine) -> String {
        self.ranges_from(0, place)
    }

    /// The declaration around, where messages name it, and the ranges of the sums that an index depends on.
    pub(super) fn stands_in(&self, place: &Affine) -> String {
        let Some(declaration) = &self.place else {
            return self.ranges_of(place);
        };
        let ranges = self.ranges_from(declaration.own, place);
        let parts = [declaration.text.clone(), ranges];
        let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        parts.join(", ")
    }

    fn ranges_from(&self, first: usize, place: &Affine) -> String {
        let shown = self
            .indices
            .iter()
            .skip(first)
            .filter(|index| place.depends_on(index.variable));
        let ranges: Vec<String> = shown
            .map(
                |Index {
                     name,
                     start,
                     end,
                     offset,
                     ..
                 }| {
                    let bound = |bound: &Affine| {
                        let own = bound.plus_scaled(offset, 1);
                        self.in_words(own.as_ref().unwrap_or(bound))
                    };
                    format!("{name} in {}..{}", bound(start), bound(end))
                },
            )
            .collect();
        ranges.join(", ")
    }

    /// An affine expression with the user's names of indices.
    pub(super) fn in_words(&self, affine: &Affine) -> String {
        self.with_names(affine).to_string()
    }

    fn with_names(&self, affine: &Affine) -> Affine {
        let index_of = |symbol: &IndexSymbol| {
            let mut indices = self.indices.iter();
            indices.find(|x| *symbol == IndexSymbol::Loop(x.variable))
        };
        // The variable is the index less its offset.
        let mut plain = affine.clone();
        for (symbol, coefficient) in &affine.terms {
            if let Some(index) = index_of(symbol) {
                let less = plain.plus_scaled(&index.offset, coefficient.saturating_neg());
                plain = less.unwrap_or(plain);
            }
        }
        let named = |(symbol, coefficient): &(IndexSymbol, i64)| {
            let symbol = match (index_of(symbol), symbol) {
                (Some(index), _) => IndexSymbol::Field(index.name.clone()),
                (None, IndexSymbol::Entry(list, place)) => {
                    IndexSymbol::Entry(list.clone(), self.with_names(place))
                }
                (None, symbol) => symbol.clone(),
            };
            (symbol, *coefficient)
        };
        Affine {
            constant: plain.constant,
            terms: plain.terms.iter().map(named).collect(),
        }
    }

    /// The side on which an index leaves its array for all values of the generic lengths; `None` if there may be
    /// lengths for which it stays inside. Lengths for which nothing is indexed at all are ignored.
    ///
    /// An index that is beyond the end for small and for large lengths is so in between, because index and length are
    /// affine in each length; an index that changes sides may be inside for some lengths.
    fn always_outside(&self, place: &Affine, length: Option<&Affine>) -> Option<Side> {
        self.always_outside_on(&self.loops_around(place), place, length)
    }

    /// The same on the turns of these loops.
    pub(super) fn always_outside_on(
        &self,
        needed: &[Index],
        place: &Affine,
        length: Option<&Affine>,
    ) -> Option<Side> {
        let bounds = needed.iter().flat_map(|index| [&index.start, &index.end]);
        let affines: Vec<&Affine> = bounds.chain([place]).chain(length).collect();
        let names = generic_lengths(&affines);
        let weight = |affine: &Affine| {
            let coefficients = affine.terms.iter().map(|(_, factor)| factor.unsigned_abs());
            coefficients.fold(affine.constant.unsigned_abs(), u64::saturating_add)
        };
        let weights = affines.iter().map(|affine| weight(affine));
        let large = weights.fold(LARGE_LENGTH, u64::saturating_add);
        let of_run_time = affines.iter().any(|affine| affine.is_of_run_time());
        let mut looked_at = assignments(names.len(), large.min(MAX_LENGTH) as i64);
        if of_run_time {
            if names.len() > MAX_COMBINED {
                return None;
            }
            let least = match self.is_of_run_time_length() {
                true => SMALL_LENGTHS.0,
                false => 0,
            };
            looked_at.extend(combinations(names.len(), least));
        }
        let mut side = None;
        for lengths in looked_at {
            let length_of = |name: &str| {
                let at = names.iter().position(|other| *other == name);
                at.map_or(0, |at| lengths[at])
            };
            let mut nest = Nest {
                indices: needed,
                size: &length_of,
                values: Vec::new(),
                trips: 0,
            };
            let length = length.map_or(i64::MAX, |length| nest.evaluate(length));
            match nest.visit(place, length) {
                Visit::Outside(found) if side.is_none_or(|side| side == found) => {
                    side = Some(found);
                }
                Visit::NoTurns => {}
                Visit::Inside | Visit::Outside(_) => return None,
            }
        }
        side
    }

    /// Only the loops on which an index depends, so that long loops beside them do not use up the turns.
    pub(super) fn loops_around(&self, place: &Affine) -> Vec<Index> {
        let depends = |affine: &Affine, index: &Index| affine.depends_on(index.variable);
        self.indices
            .iter()
            .filter(|index| {
                let bounds = |other: &&Index| [&other.start, &other.end].map(Clone::clone);
                depends(place, index)
                    || self.indices.iter().any(|other| {
                        bounds(&other).iter().any(|bound| depends(bound, index))
                            || bounds(index).iter().any(|bound| depends(bound, other))
                    })
            })
            .cloned()
            .collect()
    }
}

/// The end beyond which an index is outside its array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Below,
    Above,
}

/// The result of running an index through the turns of a nest of loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Visit {
    /// In some turn the index is outside the array.
    Outside(Side),
    /// In all examined turns it is inside.
    Inside,
    /// There is no trip.
    NoTurns,
}

/// A length that is large compared with small constants in indices; the magnitudes of these are added.
const LARGE_LENGTH: u64 = 30;
/// The largest length that is examined.
const MAX_LENGTH: u64 = 1 << 32;
/// All lengths in this range are examined. Arrays of one element, for which `q[2*i]` is correct, are never intended.
const SMALL_LENGTHS: (i64, i64) = (2, 12);

/// A field may be an index itself, or an end of a range: all combinations of these values are examined as well, in models
/// of run-time length from the least of [`SMALL_LENGTHS`] on.
const SMALL_VALUES: [i64; 9] = [0, 1, 2, 3, 4, 5, 6, 8, 12];

/// The number of fields of which that is possible.
const MAX_COMBINED: usize = 3;

/// The generic lengths that stand in indices, each once.
fn generic_lengths<'a>(affines: &[&'a Affine]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for (symbol, _) in affines.iter().flat_map(|affine| &affine.terms) {
        if let IndexSymbol::ConstParameter(name) | IndexSymbol::Field(name) = symbol
            && !names.contains(&name.as_str())
        {
            names.push(name);
        }
    }
    names
}

/// The lengths to be examined: small ones, large ones, and combinations in which each in turn is much larger and much
/// smaller than the others.
fn assignments(count: usize, large: i64) -> Vec<Vec<i64>> {
    let (least, small) = SMALL_LENGTHS;
    let equal = (least..=small).chain([large, 2 * large]);
    let mut all: Vec<Vec<i64>> = equal.map(|length| vec![length; count]).collect();
    for at in 0..count {
        for (own, others) in [
            (large, least),
            (large, small),
            (least, large),
            (small, large),
        ] {
            let mut lengths = vec![others; count];
            lengths[at] = own;
            all.push(lengths);
        }
    }
    all
}

/// All combinations of [`SMALL_VALUES`] from the least on.
fn combinations(count: usize, least: i64) -> Vec<Vec<i64>> {
    let values = SMALL_VALUES.into_iter().filter(|value| *value >= least);
    let values: Vec<i64> = values.collect();
    let mut all = vec![Vec::new()];
    for _ in 0..count {
        let longer = |before: &Vec<i64>| -> Vec<Vec<i64>> {
            let each = values.iter();
            each.map(|value| [&before[..], &[*value]].concat())
                .collect()
        };
        all = all.iter().flat_map(longer).collect();
    }
    all
}

/// A nest of loops that is run to find the values of an index.
struct Nest<'a> {
    indices: &'a [Index],
    size: &'a dyn Fn(&str) -> i64,
    values: Vec<i64>,
    trips: u64,
}

impl Nest<'_> {
    fn evaluate(&self, affine: &Affine) -> i64 {
        affine
            .terms
            .iter()
            .fold(affine.constant, |sum, (symbol, coefficient)| {
                let value = match symbol {
                    IndexSymbol::Loop(variable) => {
                        let at = self
                            .indices
                            .iter()
                            .position(|index| index.variable == *variable);
                        at.and_then(|at| self.values.get(at).copied()).unwrap_or(0)
                    }
                    IndexSymbol::ConstParameter(name) | IndexSymbol::Field(name) => {
                        (self.size)(name)
                    }
                    // Indices with entries of lists are left to the run time.
                    IndexSymbol::Entry(..) | IndexSymbol::Within(_) => 0,
                };
                sum.saturating_add(coefficient.saturating_mul(value))
            })
    }

    fn visit(&mut self, place: &Affine, length: i64) -> Visit {
        self.trips += 1;
        let Some(index) = self.indices.get(self.values.len()) else {
            let value = self.evaluate(place);
            return if value < 0 {
                Visit::Outside(Side::Below)
            } else if value >= length {
                Visit::Outside(Side::Above)
            } else {
                Visit::Inside
            };
        };
        let (start, end) = (self.evaluate(&index.start), self.evaluate(&index.end));
        let mut found = Visit::NoTurns;
        // The last and the first turn come first: there, indices that run too far do so.
        let ends = [end.saturating_sub(1), start];
        let ends = ends.into_iter().filter(|_| start < end);
        for value in ends.chain((start.saturating_add(1)..end.saturating_sub(1)).rev()) {
            if self.trips > TRIPS {
                return Visit::Inside;
            }
            self.values.push(value);
            let visit = self.visit(place, length);
            self.values.pop();
            match visit {
                Visit::Outside(_) => return visit,
                Visit::Inside => found = Visit::Inside,
                Visit::NoTurns => {}
            }
        }
        found
    }
}

/// Whether an index stays inside its array: from its least value, and its largest one less the length.
fn is_inside(low: &Affine, beyond: &Affine) -> bool {
    beyond.as_constant().is_some_and(|value| value < 0)
        && low.as_constant().is_some_and(|value| value >= 0)
}

fn coefficient(affine: &Affine, symbol: &IndexSymbol) -> i64 {
    affine
        .terms
        .iter()
        .find(|(s, _)| s == symbol)
        .map_or(0, |(_, coefficient)| *coefficient)
}
