//! Products of exponentials and what is infinite where these are zero, or infinite themselves.
//!
//! ```text
//! E = eᵘ,  S = r + d E        E/S² = 1/(S (r/E + d))
//! E = e^(−1/x²)               2 E/x³ = { 0  where E ≤ 0;  2 E/x³  elsewhere }
//! C = cosh u                  ln C = { |u| − ln 2  where C is infinite;  ln C  elsewhere },  ln S = { u + ln d  where S is infinite;  ln S  elsewhere }
//! ```
//!
//! The slope E/S² of a logistic function 1/S is infinite over infinite where E is infinite, and zero in truth. Divided by
//! E, a sum is finite there. An exponential whose exponent has a pole vanishes faster than any power grows: where it is
//! zero, so is its product with poles. The logarithm of a sum with an exponential, or of a hyperbolic cosine, is as large as its
//! argument where that overflows.

use super::facts::{argument_of_logarithm, factors_of, is_surely_positive, is_zero, moves};
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};

/// A product of an exponential over sums with it, in terms of these sums divided by it.
pub(super) fn over_exponentials(graph: &mut Graph, x: ExprId) -> ExprId {
    let factors = factors_of(graph, x);
    for (exponential, k) in &factors {
        if *k <= 0 || exponent_of(graph, *exponential).is_none() {
            continue;
        }
        for (sum, m) in &factors {
            let divided = match *m {
                1 => terms_times(graph, *sum, (*exponential, *k))
                    .map(|divided| [(*exponential, -k), (*sum, -1), (divided, 1)]),
                m if m < 0 => sum_over(graph, *sum, *exponential).map(|quotient| {
                    let times = (*k).min(m.saturating_neg());
                    [(*exponential, -times), (*sum, times), (quotient, -times)]
                }),
                _ => None,
            };
            if let Some(changes) = divided {
                let coefficient = graph.as_multiple(x).0;
                return graph.product(coefficient, &[&factors[..], &changes].concat());
            }
        }
    }
    x
}

/// The depth to which factors and terms are searched for poles.
const MAX_DEPTH: usize = 4;

/// A product with zero where an exponential in it is zero, if its exponent has a pole, and another factor has one in the same inputs.
pub(super) fn where_exponentials_vanish(graph: &mut Graph, x: ExprId) -> ExprId {
    let factors = factors_of(graph, x);
    let mut exponentials = factors
        .iter()
        .filter(|(_, k)| *k > 0)
        .filter_map(|(y, _)| Some((*y, exponential_in(graph, *y, MAX_DEPTH)?)));
    let exponential = exponentials.find(|(own, exponential)| {
        let inputs = graph.inputs_of(*exponential);
        let diverges = |(y, n): &(ExprId, i32)| {
            let concerns = |y: ExprId| graph.inputs_of(y).iter().any(|leaf| inputs.contains(leaf));
            y != own && has_pole(graph, *y, *n, MAX_DEPTH) && concerns(*y)
        };
        factors.iter().any(diverges)
    });
    let Some((_, exponential)) = exponential else {
        return x;
    };
    let zero = graph.constant(Constant::ZERO);
    graph.select(Comparison::LessOrEqual, exponential, zero, zero, x)
}

/// An exponential whose exponent has a pole, that an expression is a multiple of: as a factor, in all terms of a sum, or as the condition
/// under which this is zero.
fn exponential_in(graph: &Graph, x: ExprId, depth: usize) -> Option<ExprId> {
    let depth = depth.checked_sub(1)?;
    let x = graph.as_multiple(x).1;
    match graph.node(x) {
        Node::Call { .. } => {
            let exponent = exponent_of(graph, x)?;
            has_pole(graph, exponent, 1, MAX_DEPTH).then_some(x)
        }
        Node::Product(factors) => {
            let mut above = factors.iter().filter(|(_, n)| *n > 0);
            above.find_map(|(y, _)| exponential_in(graph, *y, depth))
        }
        Node::Sum { constant, terms } if constant.is_zero() => {
            let mut own = terms.iter().map(|(_, y)| exponential_in(graph, *y, depth));
            let first = own.next()??;
            own.all(|other| other == Some(first)).then_some(first)
        }
        Node::Select {
            comparison: Comparison::LessOrEqual,
            left,
            right,
            then,
            ..
        } if is_zero(graph, *right) && is_zero(graph, *then) => {
            exponential_in(graph, *left, depth).filter(|exponential| exponential == left)
        }
        _ => None,
    }
}

/// u of eᵘ.
fn exponent_of(graph: &Graph, x: ExprId) -> Option<ExprId> {
    match graph.node(x) {
        Node::Call {
            function: Function::Exp,
            arguments,
        } => arguments.first().copied(),
        _ => None,
    }
}

/// Whether xⁿ is infinite where something in it vanishes.
fn has_pole(graph: &Graph, x: ExprId, n: i32, depth: usize) -> bool {
    let Some(depth) = depth.checked_sub(1) else {
        return false;
    };
    let x = graph.as_multiple(x).1;
    if !moves(graph, x) {
        return false;
    }
    match graph.node(x) {
        Node::Product(factors) if n > 0 => {
            (factors.iter()).any(|(y, m)| has_pole(graph, *y, *m, depth))
        }
        Node::Sum { terms, .. } if n > 0 => {
            (terms.iter()).any(|(_, y)| has_pole(graph, *y, 1, depth))
        }
        Node::Power { base, exponent } => {
            let exponent = graph.as_constant(*exponent);
            exponent.is_some_and(|exponent| exponent.is_negative() == (n > 0))
                && !is_surely_positive(graph, *base)
        }
        Node::Call {
            function: Function::Exp | Function::Cosh,
            ..
        } => false,
        _ => n < 0 && !is_surely_positive(graph, x),
    }
}

/// The logarithm of a sum with an exponential or of a hyperbolic cosine, with its value where these are infinite; another one as it is.
pub(super) fn logarithm_where_infinite(graph: &mut Graph, x: ExprId) -> ExprId {
    let Some(argument) = argument_of_logarithm(graph, x) else {
        return x;
    };
    let Some(value) = logarithm_of_infinite(graph, argument) else {
        return x;
    };
    let most = graph.constant(Constant::float(f64::MAX));
    graph.select(Comparison::Greater, argument, most, value, x)
}

/// |u| + ln (c/2) of c cosh u, and u + ln (c d) of c (r + d eᵘ).
fn logarithm_of_infinite(graph: &mut Graph, x: ExprId) -> Option<ExprId> {
    let (c, inner) = graph.as_multiple(x);
    if c.is_negative() {
        return None;
    }
    if let Node::Call {
        function: Function::Cosh,
        arguments,
    } = graph.node(inner)
    {
        let arguments = arguments.clone();
        let size = graph.call(Function::Abs, &arguments);
        let half = graph.constant(c * Constant::rational(1, 2)?);
        let number = graph.call(Function::Ln, &[half]);
        return Some(graph.add(size, number));
    }
    let (_, terms) = graph.as_sum(inner)?;
    let mut factors = terms.iter().flat_map(|(_, term)| factors_of(graph, *term));
    let exponential = factors.find(|(y, _)| exponent_of(graph, *y).is_some() && moves(graph, *y));
    let exponential = exponential?.0;
    let exponent = exponent_of(graph, exponential)?;
    let (_, multiples) = parts_with(graph, inner, exponential)?;
    let multiples = over(graph, multiples, exponential);
    let multiple = graph.linear(Constant::ZERO, &multiples);
    let multiple = graph.scale(c, multiple);
    let number = graph.call(Function::Ln, &[multiple]);
    Some(graph.add(exponent, number))
}

/// Terms with their coefficients.
type Terms = Vec<(Constant, ExprId)>;

/// The terms of a sum without an exponential, which are at rest, and its multiples of the exponential; `None` for other sums, and those
/// without a multiple.
fn parts_with(graph: &Graph, sum: ExprId, exponential: ExprId) -> Option<(Terms, Terms)> {
    let (_, terms) = graph.as_sum(sum)?;
    let (mut multiples, mut others) = (Vec::new(), Vec::new());
    for (c, term) in terms {
        let factors = factors_of(graph, *term);
        let (own, rest): (Vec<_>, Vec<_>) =
            factors.into_iter().partition(|(y, _)| *y == exponential);
        if rest.iter().any(|(y, _)| moves(graph, *y)) {
            return None;
        }
        match own[..] {
            [] => others.push((*c, *term)),
            [(_, 1)] => multiples.push((*c, *term)),
            _ => return None,
        }
    }
    (!multiples.is_empty()).then_some((others, multiples))
}

/// Terms over an exponential.
fn over(graph: &mut Graph, terms: Terms, exponential: ExprId) -> Terms {
    let mut quotients = Terms::with_capacity(terms.len());
    for (c, term) in terms {
        quotients.push((c, graph.divide(term, exponential)));
    }
    quotients
}

/// S/E of a sum S of multiples of E and of what is at rest; `None` for other sums.
fn sum_over(graph: &mut Graph, sum: ExprId, exponential: ExprId) -> Option<ExprId> {
    let (constant, _) = graph.as_sum(sum)?;
    let (others, multiples) = parts_with(graph, sum, exponential)?;
    let rest = graph.linear(constant, &others);
    let mut divided = vec![(Constant::ONE, graph.divide(rest, exponential))];
    divided.extend(over(graph, multiples, exponential));
    Some(graph.linear(Constant::ZERO, &divided))
}

/// The sum of the terms of a sum times Eᵏ, if each is over a sum with E.
fn terms_times(graph: &mut Graph, sum: ExprId, (exponential, k): (ExprId, i32)) -> Option<ExprId> {
    let (constant, terms) = graph.as_sum(sum)?;
    if !constant.is_zero() {
        return None;
    }
    let terms = terms.to_vec();
    let mut products = Vec::with_capacity(terms.len());
    for (c, term) in terms {
        let mut factors = factors_of(graph, term);
        let is_over = |graph: &mut Graph, (y, n): (ExprId, i32)| {
            n < 0 && sum_over(graph, y, exponential).is_some()
        };
        if !factors.iter().any(|factor| is_over(graph, *factor)) {
            return None;
        }
        factors.push((exponential, k));
        let number = graph.as_multiple(term).0;
        let product = graph.product(number, &factors);
        products.push((c, over_exponentials(graph, product)));
    }
    Some(graph.linear(Constant::ZERO, &products))
}
