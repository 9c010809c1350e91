//! Indices: affine arithmetic on the syntax, and the values that an index can take.

use super::{Index, Lowerer};
use crate::check::Symbol;
use crate::diagnostic::{Kind, Span};
use crate::expr::input::{Affine, IndexSymbol};
use crate::model::declared::Extent;
use crate::syntax::ast::{BinaryOperator, Expr, ExprKind};
use crate::syntax::context::FieldKind;

/// How many trips of a nest are looked at before an index is believed to stay inside.
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
            return Some(Affine::symbol(IndexSymbol::Loop(index.variable)));
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

    /// `left[k]`; the list is as long as its largest index asks for.
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

    /// The largest or smallest value over the ranges of all indices around, as far as ranges are
    /// independent of each other; `None` on overflow.
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

    /// Whether an index stays inside an array (of a length unknown here: is not negative), as far as
    /// that can be decided; if not, reports it.
    pub(super) fn in_bounds(
        &mut self,
        array: &str,
        place: &Affine,
        length: Option<&Affine>,
        span: Span,
    ) -> bool {
        // What a list holds is known at run time.
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
        let fits = beyond.as_constant().is_some_and(|value| value < 0)
            && low.as_constant().is_some_and(|value| value >= 0);
        if fits {
            return true;
        }
        let outside = SIZES.iter().map(|size| self.outside(place, length, *size));
        let Some(sides) = outside.collect::<Option<Vec<Side>>>() else {
            if let Some(length) = length {
                self.require_index(array, place, Extent::Known(length.clone()));
            }
            return true;
        };
        // The extremes say it more plainly than the index itself, where they are attained.
        let value = if sides[0] == Side::Above { high } else { low };
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
                     name, start, end, ..
                 }| {
                    format!("{name} in {}..{}", self.in_words(start), self.in_words(end))
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
        let named = |(symbol, coefficient): &(IndexSymbol, i64)| {
            let index = self
                .indices
                .iter()
                .find(|x| *symbol == IndexSymbol::Loop(x.variable));
            let symbol = match (index, symbol) {
                (Some(index), _) => IndexSymbol::Field(index.name.clone()),
                (None, IndexSymbol::Entry(list, place)) => {
                    IndexSymbol::Entry(list.clone(), self.with_names(place))
                }
                (None, symbol) => symbol.clone(),
            };
            (symbol, *coefficient)
        };
        Affine {
            constant: affine.constant,
            terms: affine.terms.iter().map(named).collect(),
        }
    }

    /// On which side some trip of the loops around leaves the array, when generic lengths take some
    /// sizes; `None` if none does, as far as a reasonable number of trips tells.
    fn outside(&self, place: &Affine, length: Option<&Affine>, size: Sizes) -> Option<Side> {
        let depends = |affine: &Affine, index: &Index| affine.depends_on(index.variable);
        // Only the loops that have a say, lest long ones beside them use up the trips.
        let needed: Vec<Index> = self
            .indices
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
            .collect();
        let rank = |name: &str| {
            let lengths = self.context.fields.iter().map(|field| &field.name);
            let names = self.context.const_parameters.iter().chain(lengths);
            names.take_while(|other| *other != name).count().min(5) as i64
        };
        let size = |name: &str| size.0 + size.1 * rank(name);
        let mut nest = Nest {
            indices: &needed,
            size: &size,
            values: Vec::new(),
            trips: 0,
        };
        let length = length.map_or(i64::MAX, |length| nest.evaluate(length));
        nest.outside(place, length)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Below,
    Above,
}

/// Sizes given to generic lengths, in the order of their declaration: (first, step). An index that
/// is outside for all of these is outside for good: they put any two lengths in either order.
type Sizes = (i64, i64);
const SIZES: [Sizes; 3] = [(7, 3), (22, -3), (11, 0)];

/// A nest of loops that is run to see where an index goes.
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
                    IndexSymbol::Entry(..) => 0,
                };
                sum.saturating_add(coefficient.saturating_mul(value))
            })
    }

    fn outside(&mut self, place: &Affine, length: i64) -> Option<Side> {
        self.trips += 1;
        let Some(index) = self.indices.get(self.values.len()) else {
            let value = self.evaluate(place);
            return if value < 0 {
                Some(Side::Below)
            } else {
                (value >= length).then_some(Side::Above)
            };
        };
        let (start, end) = (self.evaluate(&index.start), self.evaluate(&index.end));
        // From the end, where indices that run too far do so.
        for value in (start..end).rev() {
            if self.trips > TRIPS {
                return None;
            }
            self.values.push(value);
            let side = self.outside(place, length);
            self.values.pop();
            if side.is_some() {
                return side;
            }
        }
        None
    }
}

fn coefficient(affine: &Affine, symbol: &IndexSymbol) -> i64 {
    affine
        .terms
        .iter()
        .find(|(s, _)| s == symbol)
        .map_or(0, |(_, coefficient)| *coefficient)
}
