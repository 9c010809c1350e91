//! Converts expressions to syntax, so that formulas of generated models are printed like those of users.

use crate::diagnostic::span::Span;
use crate::expr::constant::Constant;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::hash::Map;
use crate::expr::input::{Affine, IndexSymbol, Input};
use crate::expr::sorting::sort_by_key;
use crate::syntax::ast::{BinaryOperator, Expr, ExprKind, Range, Spanned};

/// The syntax of an expression with names of coordinates, velocities and momenta from `state`.
///
/// Nothing where it has more than `most` nodes, or a leaf without a name.
pub(super) fn as_syntax(
    graph: &Graph,
    id: ExprId,
    most: usize,
    state: &dyn Fn(&Input) -> Option<Expr>,
) -> Option<Expr> {
    let mut built: Map<ExprId, (Expr, usize)> = Map::default();
    for id in graph.reachable(&[id]) {
        let node = graph.node(id);
        let sizes = node.children().into_iter().map(|child| built[&child].1);
        let size = 1 + sizes.sum::<usize>();
        if size > most {
            return None;
        }
        let expr = written(graph, node, &|child| built[&child].0.clone(), state)?;
        built.insert(id, (expr, size));
    }
    built.remove(&id).map(|(expr, _)| expr)
}

fn written(
    graph: &Graph,
    node: &Node,
    child: &dyn Fn(ExprId) -> Expr,
    state: &dyn Fn(&Input) -> Option<Expr>,
) -> Option<Expr> {
    Some(match node {
        Node::Constant(value) => constant(*value)?,
        Node::Input(input) => match input {
            Input::Coordinate(_) | Input::Velocity(_) | Input::Momentum(_) => state(input)?,
            Input::Time => name("t"),
            Input::Control(field) | Input::Parameter(field) => name(field),
            Input::ParameterElement(field, index) => element(name(field), index),
            Input::Multiplier(index) => element(name("mu"), index),
            Input::Integer(value) => affine(value),
            Input::Placeholder(..) => return None,
        },
        Node::Sum {
            constant: number,
            terms,
        } => {
            let (number, terms) = without_outer_sign(graph, *number, terms);
            let mut sum: Option<Expr> = None;
            for (coefficient, x) in terms {
                sum = Some(plus(sum, coefficient, child(x))?);
            }
            match number.is_zero() {
                true => sum?,
                false => {
                    let operator = signed(number.is_negative());
                    binary(operator, sum?, constant(number.abs())?)
                }
            }
        }
        Node::Product(factors) => {
            // Parameters first, as people write.
            let moves = |x: ExprId| {
                !matches!(
                    graph.node(x),
                    Node::Input(Input::Parameter(_) | Input::ParameterElement(..))
                )
            };
            let mut factors = factors.clone();
            sort_by_key(&mut factors, |(x, _)| moves(*x));
            let powers = factors.iter().map(|(x, exponent)| match exponent {
                1 => child(*x),
                _ => {
                    let exponent = integer(i64::from(*exponent));
                    binary(BinaryOperator::Power, child(*x), exponent)
                }
            });
            powers.reduce(|a, b| binary(BinaryOperator::Multiply, a, b))?
        }
        Node::Power { base, exponent } => {
            binary(BinaryOperator::Power, child(*base), child(*exponent))
        }
        Node::Call {
            function,
            arguments,
        } => call(
            function.name(),
            arguments.iter().map(|x| child(*x)).collect(),
        ),
        Node::Select {
            comparison,
            left,
            right,
            then,
            otherwise,
        } => plain(ExprKind::Select {
            comparison: *comparison,
            left: Box::new(child(*left)),
            right: Box::new(child(*right)),
            then: Box::new(child(*then)),
            otherwise: Box::new(child(*otherwise)),
        }),
        Node::Loop { range, body } => plain(ExprKind::Sum {
            range: Range {
                variable: Spanned::new(range.variable.to_string(), Span::default()),
                start: Box::new(affine(&range.start)),
                end: Box::new(affine(&range.end)),
            },
            body: Box::new(child(*body)),
        }),
    })
}

/// −(a − b) as b − a, and a sum that begins with a negative term with its first positive one in front.
fn without_outer_sign(
    graph: &Graph,
    number: Constant,
    terms: &[(Constant, ExprId)],
) -> (Constant, Vec<(Constant, ExprId)>) {
    let opposite = match terms {
        [(c, x)] if number.is_zero() && *c == Constant::MINUS_ONE => graph.as_sum(*x),
        _ => None,
    };
    let (number, mut terms) = match opposite {
        Some((number, inner)) => (-number, inner.iter().map(|(c, x)| (-*c, *x)).collect()),
        None => (number, terms.to_vec()),
    };
    if let Some(first) = terms.iter().position(|(c, _)| !c.is_negative()) {
        terms[..=first].rotate_right(1);
    }
    (number, terms)
}

/// The sum with one more term c x.
fn plus(sum: Option<Expr>, c: Constant, x: Expr) -> Option<Expr> {
    let multiple = |c: Constant, x: Expr| {
        Some(match c.is_one() {
            true => x,
            false => binary(BinaryOperator::Multiply, constant(c)?, x),
        })
    };
    Some(match sum {
        Some(sum) => binary(signed(c.is_negative()), sum, multiple(c.abs(), x)?),
        None if c.is_negative() && c.abs().is_one() => negated(x),
        None => multiple(c, x)?,
    })
}

/// A number as the language has them, without a sign; nothing for what is no number.
fn constant(value: Constant) -> Option<Expr> {
    if !value.to_f64().is_finite() {
        return None;
    }
    let text = value.abs().to_string();
    let number = |text: &str| plain(ExprKind::Number(text.to_owned()));
    let sign = |expr: Expr| match value.is_negative() {
        true => negated(expr),
        false => expr,
    };
    Some(match text.split_once('/') {
        Some((above, below)) => binary(BinaryOperator::Divide, sign(number(above)), number(below)),
        None => sign(number(&text)),
    })
}

fn integer(value: i64) -> Expr {
    let number = plain(ExprKind::Number(value.unsigned_abs().to_string()));
    match value < 0 {
        true => negated(number),
        false => number,
    }
}

fn affine(index: &Affine) -> Expr {
    let mut sum: Option<Expr> = None;
    for (symbol, coefficient) in &index.terms {
        let symbol = match symbol {
            IndexSymbol::Loop(variable) => name(&variable.to_string()),
            IndexSymbol::ConstParameter(own) | IndexSymbol::Field(own) => name(own),
            IndexSymbol::Entry(list, place) => element(name(list), place),
            IndexSymbol::Within(_) => continue,
        };
        let multiple = |factor: i64| match factor {
            1 => symbol.clone(),
            _ => binary(BinaryOperator::Multiply, integer(factor), symbol.clone()),
        };
        sum = Some(match (sum, *coefficient) {
            (Some(sum), _) => {
                let size = i64::try_from(coefficient.unsigned_abs()).unwrap_or(i64::MAX);
                binary(signed(*coefficient < 0), sum, multiple(size))
            }
            (None, -1) => negated(symbol.clone()),
            (None, factor) => multiple(factor),
        });
    }
    match (sum, index.constant) {
        (None, value) => integer(value),
        (Some(sum), 0) => sum,
        (Some(sum), value) => {
            let size = i64::try_from(value.unsigned_abs()).unwrap_or(i64::MAX);
            binary(signed(value < 0), sum, integer(size))
        }
    }
}

fn signed(is_negative: bool) -> BinaryOperator {
    match is_negative {
        true => BinaryOperator::Subtract,
        false => BinaryOperator::Add,
    }
}

fn plain(kind: ExprKind) -> Expr {
    Spanned::new(kind, Span::default())
}

fn negated(expr: Expr) -> Expr {
    plain(ExprKind::Negate(Box::new(expr)))
}

fn binary(operator: BinaryOperator, left: Expr, right: Expr) -> Expr {
    plain(ExprKind::Binary {
        operator,
        left: Box::new(left),
        right: Box::new(right),
    })
}

/// A name as an expression.
pub(super) fn name(name: &str) -> Expr {
    plain(ExprKind::Name(name.to_owned()))
}

/// `array[index]`
pub(super) fn element(array: Expr, index: &Affine) -> Expr {
    plain(ExprKind::Index {
        value: Box::new(array),
        index: Box::new(affine(index)),
    })
}

/// `function(arguments)`
pub(super) fn call(function: &str, arguments: Vec<Expr>) -> Expr {
    plain(ExprKind::Call {
        function: Spanned::new(function.to_owned(), Span::default()),
        arguments,
    })
}
