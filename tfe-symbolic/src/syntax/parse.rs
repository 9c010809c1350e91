//! Attribute text to syntax tree.
//!
//! Precedence, from weak to strong: `+ -`; `* /`; unary minus; `^` (right associative); `[index]`.
//! Hence `-x^2` is `-(x^2)`, while `2*-x` and `x^-2` need no parentheses.

mod expectation;
mod limits;
mod separators;
mod slips;

use std::sync::LazyLock;

use pest::Parser as _;
use pest::error::{ErrorVariant, InputLocation};
use pest::iterators::{Pair, Pairs};
use pest::pratt_parser::{Assoc, Op, PrattParser};

use crate::diagnostic::{Bag, Kind, Span, nearest};
use crate::expr::comparison::Comparison;
use crate::syntax::ast::{
    Array, BinaryOperator, ElementSyntax, Entry, Expr, ExprKind, Item, Name, Pass, Range, Spanned,
};
use crate::syntax::grammar::{Rule, TfeParser};
use crate::vocabulary::{Argument, is_function};
use expectation::{found_at, wanted};
use limits::within_limits;
pub use limits::{MAX_NESTING, MAX_OPERATORS};
pub(crate) use separators::missing_commas;
pub use separators::split_arguments;
use slips::{slip, tidy};

static PRATT: LazyLock<PrattParser<Rule>> = LazyLock::new(|| {
    PrattParser::new()
        .op(Op::infix(Rule::add, Assoc::Left) | Op::infix(Rule::subtract, Assoc::Left))
        .op(Op::infix(Rule::multiply, Assoc::Left)
            | Op::infix(Rule::divide, Assoc::Left)
            | Op::infix(Rule::missing, Assoc::Left))
        .op(Op::prefix(Rule::sign))
        .op(Op::infix(Rule::power, Assoc::Right) | Op::infix(Rule::double_star, Assoc::Right))
        .op(Op::postfix(Rule::index))
});

/// Parses one argument of the attribute.
///
/// `offset` is where `text` begins in the attribute; all spans count from the attribute's begin.
/// `None` after a mistake that leaves nothing to work with; the mistake is in the bag.
pub fn parse_item(text: &str, offset: usize, bag: &mut Bag) -> Option<Spanned<Item>> {
    let blanks = text.len() - text.trim_start().len();
    let word = first_word(text);
    let span = Span::new(offset + blanks, offset + blanks + word.len());
    if word.is_empty() {
        let found = found_at(text, blanks);
        let span = Span::new(span.start, offset + found.end);
        let wanted = "an argument such as `lagrangian = …`".into();
        bag.push(
            span,
            Kind::Expected {
                wanted,
                found: found.words,
                form: None,
            },
        );
        return None;
    }
    let Some(argument) = Argument::of_word(word) else {
        let nearest = nearest(word, Argument::all().map(Argument::word));
        bag.push(
            span,
            Kind::UnknownArgument {
                name: word.to_owned(),
                nearest,
            },
        );
        return None;
    };
    let rule = rule_of(argument);
    if let Err((at, kind)) = within_limits(text) {
        bag.push(Span::new(offset + at.start, offset + at.end), kind);
        return None;
    }
    match TfeParser::parse(rule, text) {
        Ok(mut pairs) => {
            let pair = pairs.next()?;
            let item = Builder { offset, bag }.item(pair)?;
            Some(Spanned::new(item, span))
        }
        Err(error) => {
            let at = match error.location {
                InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
            };
            if let Some((place, kind)) = slip(word, text, at) {
                bag.push(Span::new(offset + place.start, offset + place.end), kind);
                return None;
            }
            let wanted = match &error.variant {
                ErrorVariant::ParsingError { positives, .. } => wanted(positives),
                ErrorVariant::CustomError { message } => message.clone(),
            };
            let found = found_at(text, at);
            let span = Span::new(offset + found.start, offset + found.end);
            let follows_word = text[..found.start].trim() == word;
            bag.push(
                span,
                Kind::Expected {
                    wanted,
                    found: found.words,
                    form: follows_word.then(|| argument.form()),
                },
            );
            None
        }
    }
}

/// What the grammar calls an argument.
fn rule_of(argument: Argument) -> Rule {
    match argument {
        Argument::Coordinates => Rule::coordinates,
        Argument::Momenta => Rule::momenta,
        Argument::Input => Rule::input,
        Argument::Let => Rule::binding,
        Argument::Lagrangian => Rule::lagrangian,
        Argument::Hamiltonian => Rule::hamiltonian,
        Argument::Force => Rule::force,
        Argument::Dissipation => Rule::dissipation,
        Argument::TimeTransformation => Rule::time_transformation,
        Argument::Constraint => Rule::constraint,
        Argument::Output => Rule::output,
        Argument::Event => Rule::event,
        Argument::Sensitivity => Rule::sensitivity,
        Argument::Solver => Rule::solver,
        Argument::Model => Rule::model,
        Argument::Crate => Rule::location,
    }
}

/// The word that an argument begins with.
pub(crate) fn first_word(text: &str) -> &str {
    let text = text.trim_start();
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_'));
    &text[..end.unwrap_or(text.len())]
}

/// Parses one expression (of a test or a tool) outside any argument.
pub fn parse_expression(text: &str, bag: &mut Bag) -> Option<Expr> {
    const PREFIX: &str = "dissipation=";
    let item = parse_item(&format!("{PREFIX}{text}"), 0, bag)?;
    match item.node {
        Item::Dissipation(expr) => Some(expr),
        _ => None,
    }
}

/// Turns pest's pairs into syntax; pairs have the shape of the grammar, so nothing can be missing.
struct Builder<'a> {
    offset: usize,
    bag: &'a mut Bag,
}

impl Builder<'_> {
    fn span(&self, pair: &Pair<'_, Rule>) -> Span {
        let span = pair.as_span();
        Span::new(self.offset + span.start(), self.offset + span.end())
    }

    fn name(&self, pair: &Pair<'_, Rule>) -> Name {
        Spanned::new(pair.as_str().to_owned(), self.span(pair))
    }

    fn item(&mut self, pair: Pair<'_, Rule>) -> Option<Item> {
        let rule = pair.as_rule();
        let mut parts = Parts(pair.into_inner());
        Some(match rule {
            Rule::coordinates => Item::Coordinates(self.arrays(parts)?),
            Rule::momenta => Item::Momenta(self.arrays(parts)?),
            Rule::input => {
                let names = parts.0.filter(|pair| pair.as_rule() == Rule::name);
                Item::Input(names.map(|pair| self.name(&pair)).collect())
            }
            Rule::binding => Item::Let {
                name: self.name(&parts.next(Rule::name)?),
                value: self.expression(parts.next(Rule::expression)?)?,
            },
            Rule::lagrangian => Item::Lagrangian(self.expression(parts.next(Rule::expression)?)?),
            Rule::hamiltonian => Item::Hamiltonian(self.expression(parts.next(Rule::expression)?)?),
            Rule::dissipation => Item::Dissipation(self.expression(parts.next(Rule::expression)?)?),
            Rule::time_transformation => {
                Item::TimeTransformation(self.expression(parts.next(Rule::expression)?)?)
            }
            Rule::force => Item::Force {
                target: self.expression(parts.next(Rule::expression)?)?,
                value: self.expression(parts.next(Rule::expression)?)?,
            },
            Rule::constraint | Rule::output | Rule::event => {
                let name = self.name(&parts.next(Rule::name)?);
                let range = match parts.optional(Rule::range) {
                    Some(range) => Some(self.range(range)?),
                    None => None,
                };
                let value = self.expression(parts.next(Rule::expression)?)?;
                match rule {
                    Rule::constraint => Item::Constraint { name, range, value },
                    _ => Item::Output { name, range, value },
                }
            }
            Rule::sensitivity => Item::Sensitivity(self.expressions(parts)?),
            Rule::solver => Item::Solver {
                name: self.name(&parts.next(Rule::name)?),
                element: self.element(parts.next(Rule::element)?)?,
            },
            Rule::model => Item::Model {
                name: self.name(&parts.next(Rule::name)?),
                passes: self.passes(parts)?,
            },
            Rule::location => {
                let path = parts.next(Rule::path)?;
                let span = self.span(&path);
                let text = path
                    .as_str()
                    .chars()
                    .filter(|c| !c.is_whitespace())
                    .collect();
                Item::Crate(Spanned::new(text, span))
            }
            _ => return None,
        })
    }

    fn arrays(&mut self, parts: Parts<'_>) -> Option<Vec<Array>> {
        let mut arrays = Vec::new();
        for pair in parts.0.filter(|pair| pair.as_rule() == Rule::array) {
            let mut parts = Parts(pair.into_inner());
            let name = self.name(&parts.next(Rule::name)?);
            let length = match parts.optional(Rule::expression) {
                Some(length) => Some(self.expression(length)?),
                None => None,
            };
            arrays.push(Array { name, length });
        }
        Some(arrays)
    }

    fn element(&mut self, pair: Pair<'_, Rule>) -> Option<Spanned<ElementSyntax>> {
        let span = self.span(&pair);
        let mut parts = Parts(pair.into_inner());
        let family = self.name(&parts.next(Rule::name)?);
        let nodes = parts.next(Rule::integer)?;
        let nodes = self.integer(&nodes)?;
        let rule = match parts.optional(Rule::method) {
            None => None,
            Some(rule) => {
                let mut parts = Parts(rule.into_inner());
                let name = self.name(&parts.next(Rule::name)?);
                let argument = match parts.optional(Rule::integer) {
                    Some(argument) => Some(self.integer(&argument)?),
                    None => None,
                };
                Some((name, argument))
            }
        };
        Some(Spanned::new(
            ElementSyntax {
                family,
                nodes,
                rule,
            },
            span,
        ))
    }

    fn passes(&mut self, parts: Parts<'_>) -> Option<Vec<Pass>> {
        let mut passes = Vec::new();
        for pair in parts.0.filter(|pair| pair.as_rule() == Rule::pass) {
            let mut parts = Parts(pair.into_inner());
            let word = self.name(&parts.next(Rule::name)?);
            let mut entries = Vec::new();
            for pair in parts.0.filter(|pair| pair.as_rule() == Rule::entry) {
                entries.push(self.entry(pair)?);
            }
            passes.push(Pass { word, entries });
        }
        Some(passes)
    }

    /// `value` or `target = value`
    fn entry(&mut self, pair: Pair<'_, Rule>) -> Option<Entry> {
        let mut parts = Parts(pair.into_inner());
        let first = self.expression(parts.next(Rule::expression)?)?;
        Some(match parts.next(Rule::expression) {
            None => Entry {
                target: None,
                value: first,
            },
            Some(value) => Entry {
                target: Some(first),
                value: self.expression(value)?,
            },
        })
    }

    fn integer(&mut self, pair: &Pair<'_, Rule>) -> Option<Spanned<u64>> {
        let span = self.span(pair);
        let text = pair.as_str().replace('_', "");
        match text.parse() {
            Ok(value) => Some(Spanned::new(value, span)),
            Err(_) => {
                self.bag.push(span, Kind::NumberTooLarge { number: text });
                None
            }
        }
    }

    fn range(&mut self, pair: Pair<'_, Rule>) -> Option<Range> {
        let mut parts = Parts(pair.into_inner());
        let variable = self.name(&parts.next(Rule::name)?);
        let start = Box::new(self.expression(parts.next(Rule::expression)?)?);
        let dots = parts.next(Rule::dots)?;
        let mut end = Box::new(self.expression(parts.next(Rule::expression)?)?);
        if dots.as_str().contains('=') {
            self.bag.push(self.span(&dots), Kind::InclusiveRange);
            // What was meant, so that no further mistakes follow.
            let (span, operator) = (end.span, BinaryOperator::Add);
            let one = Box::new(Spanned::new(ExprKind::Number("1".into()), span));
            let sum = ExprKind::Binary {
                operator,
                left: end,
                right: one,
            };
            end = Box::new(Spanned::new(sum, span));
        }
        Some(Range {
            variable,
            start,
            end,
        })
    }

    fn expression(&mut self, pair: Pair<'_, Rule>) -> Option<Expr> {
        let pairs = pair.into_inner();
        self.missing_operators(pairs.clone());
        // The closures below all need the builder, one at a time.
        let builder = std::cell::RefCell::new(self);
        PRATT
            .map_primary(|pair| builder.borrow_mut().primary(pair))
            .map_prefix(|sign, value| {
                let value = value?;
                let span = builder.borrow().span(&sign).join(value.span);
                Some(Spanned::new(ExprKind::Negate(Box::new(value)), span))
            })
            .map_postfix(|value, index| {
                let value = value?;
                let mut builder = builder.borrow_mut();
                let span = value.span.join(builder.span(&index));
                let index =
                    builder.expression(Parts(index.into_inner()).next(Rule::expression)?)?;
                let (value, index) = (Box::new(value), Box::new(index));
                Some(Spanned::new(ExprKind::Index { value, index }, span))
            })
            .map_infix(|left, operator, right| {
                let (left, right) = (left?, right?);
                if operator.as_rule() == Rule::missing && ends_number(&left, &right) {
                    return Some(left);
                }
                let operator = match operator.as_rule() {
                    Rule::add => BinaryOperator::Add,
                    Rule::subtract => BinaryOperator::Subtract,
                    Rule::multiply | Rule::missing => BinaryOperator::Multiply,
                    Rule::divide => BinaryOperator::Divide,
                    Rule::double_star => {
                        let mut builder = builder.borrow_mut();
                        let span = builder.span(&operator);
                        builder.bag.push(span, Kind::DoubleStar);
                        BinaryOperator::Power
                    }
                    _ => BinaryOperator::Power,
                };
                let span = left.span.join(right.span);
                let (left, right) = (Box::new(left), Box::new(right));
                Some(Spanned::new(
                    ExprKind::Binary {
                        operator,
                        left,
                        right,
                    },
                    span,
                ))
            })
            .parse(pairs)
    }

    /// Reports `2x`, `2(x)` and `x y`, naming both sides of the gap.
    fn missing_operators(&mut self, pairs: Pairs<'_, Rule>) {
        let pairs: Vec<_> = pairs.collect();
        for window in pairs
            .windows(3)
            .filter(|window| window[1].as_rule() == Rule::missing)
        {
            let (left, right) = (window[0].as_str().trim(), window[2].as_str().trim());
            // Without the blanks behind a name.
            let end = self.span(&window[2]).start + right.len();
            let span = Span::new(self.span(&window[0]).start, end);
            if is_function(left) {
                let name = left.to_owned();
                let start = self.span(&window[0]).start;
                let span = Span::new(start, start + left.len());
                self.bag.push(span, Kind::FunctionAsValue { name });
            } else if window[0].as_rule() == Rule::number && TYPES_OF_NUMBERS.contains(&right) {
                let number = left.trim_end_matches('_').to_owned();
                self.bag.push(span, Kind::NumberWithType { number });
            } else if window[0].as_str() == "0"
                && span.end - span.start == 1 + right.len()
                && let Some((radix, digits)) = in_base(right)
            {
                let kind = Kind::NumberInBase {
                    number: format!("0{right}"),
                    decimal: u64::from_str_radix(&digits, radix).ok(),
                };
                self.bag.push(span, kind);
            } else {
                let (left, right) = (tidy(left), tidy(right));
                self.bag.push(span, Kind::MissingOperator { left, right });
            }
        }
    }

    fn primary(&mut self, pair: Pair<'_, Rule>) -> Option<Expr> {
        let span = self.span(&pair);
        let rule = pair.as_rule();
        let text = pair.as_str();
        let mut parts = Parts(pair.into_inner());
        let (kind, span) = match rule {
            Rule::number => (ExprKind::Number(text.to_owned()), span),
            Rule::variable => {
                let name = parts.next(Rule::identifier)?;
                (ExprKind::Name(name.as_str().to_owned()), self.span(&name))
            }
            // Parentheses leave no trace but their place.
            Rule::group => (self.expression(parts.next(Rule::expression)?)?.node, span),
            Rule::vector => (ExprKind::Vector(self.expressions(parts)?), span),
            Rule::call => {
                let function = self.name(&parts.next(Rule::identifier)?);
                (
                    ExprKind::Call {
                        function,
                        arguments: self.expressions(parts)?,
                    },
                    span,
                )
            }
            Rule::sum => {
                let range = self.range(parts.next(Rule::range)?)?;
                let body = Box::new(self.expression(parts.next(Rule::expression)?)?);
                (ExprKind::Sum { range, body }, span)
            }
            Rule::select => {
                let left = Box::new(self.expression(parts.next(Rule::expression)?)?);
                let sign = parts.next(Rule::comparison)?;
                // Its text may hold blanks.
                let sign = sign.as_str();
                let comparison = match (sign.starts_with('<'), sign.contains('=')) {
                    (true, false) => Comparison::Less,
                    (true, true) => Comparison::LessOrEqual,
                    (false, false) => Comparison::Greater,
                    (false, true) => Comparison::GreaterOrEqual,
                };
                let right = Box::new(self.expression(parts.next(Rule::expression)?)?);
                let then = Box::new(self.expression(parts.next(Rule::expression)?)?);
                let otherwise = Box::new(self.expression(parts.next(Rule::expression)?)?);
                (
                    ExprKind::Select {
                        comparison,
                        left,
                        right,
                        then,
                        otherwise,
                    },
                    span,
                )
            }
            _ => return None,
        };
        Some(Spanned::new(kind, span))
    }

    fn expressions(&mut self, parts: Parts<'_>) -> Option<Vec<Expr>> {
        parts
            .0
            .filter(|pair| pair.as_rule() == Rule::expression)
            .map(|pair| self.expression(pair))
            .collect()
    }
}

/// What Rust may write behind a number, as in `1.0_f64`.
const TYPES_OF_NUMBERS: &[&str] = &[
    "f64", "f32", "usize", "isize", "u8", "u16", "u32", "u64", "i8", "i16", "i32", "i64",
];

/// Whether this is the type of a number, which has been reported.
fn is_type(expr: &Expr) -> bool {
    matches!(&expr.node, ExprKind::Name(name) if TYPES_OF_NUMBERS.contains(&name.as_str()))
}

/// The base and the digits of what follows the zero of `0x1F`, `0b101` or `0o17`.
fn in_base(name: &str) -> Option<(u32, String)> {
    let mut letters = name.chars();
    let radix = match letters.next()? {
        'b' => 2,
        'o' => 8,
        'x' => 16,
        _ => return None,
    };
    let digits: String = letters.filter(|letter| *letter != '_').collect();
    let are_digits = !digits.is_empty() && digits.chars().all(|digit| digit.is_digit(radix));
    are_digits.then_some((radix, digits))
}

/// Whether this follows a number as its type or as its digits to another base, which has been reported.
fn ends_number(number: &Expr, follows: &Expr) -> bool {
    let is_zero = matches!(&number.node, ExprKind::Number(number) if number == "0");
    let is_beside = number.span.end == follows.span.start;
    let has_base = |name: &str| is_zero && is_beside && in_base(name).is_some();
    is_type(follows) || matches!(&follows.node, ExprKind::Name(name) if has_base(name))
}

/// The inner pairs of a rule, punctuation skipped.
struct Parts<'a>(Pairs<'a, Rule>);

impl<'a> Parts<'a> {
    fn next(&mut self, rule: Rule) -> Option<Pair<'a, Rule>> {
        self.0.find(|pair| pair.as_rule() == rule)
    }

    fn optional(&mut self, rule: Rule) -> Option<Pair<'a, Rule>> {
        let ahead = self
            .0
            .clone()
            .find(|pair| !is_punctuation(pair.as_rule()))?;
        if ahead.as_rule() == rule {
            self.next(rule)
        } else {
            None
        }
    }
}

fn is_punctuation(rule: Rule) -> bool {
    matches!(
        rule,
        Rule::equals
            | Rule::comma
            | Rule::dot
            | Rule::open
            | Rule::close
            | Rule::open_index
            | Rule::close_index
            | Rule::turbofish
            | Rule::close_angle
    )
}
