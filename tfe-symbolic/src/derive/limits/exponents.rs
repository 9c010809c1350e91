//! Derivatives n (n − 1) … xⁿ⁻ᵏ of powers whose exponent is not a number.
//!
//! Where a number of them vanishes the derivative is zero: x¹ has no curvature, and its formula 1 · 0 · x⁻¹ is zero
//! times infinity at x = 0. A whole exponent is an index, as in `sum(i in 0..N, a[i]*x^i)`, or a length. Of a whole
//! exponent all whole factors count as such numbers, of another one those that are its multiples, but for a number.

use super::facts::{factors_of, is_at_rest, is_zero, moves};
use super::norm::Norm;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;

/// xᵉ/xⁿ → xᵉ⁻ⁿ for an exponent of fields, and |x|ᵉ/x²ⁿ likewise: 0/0 at zero as it stands. Powers of norms are treated with these.
pub(super) fn with_quotients_merged(graph: &mut Graph, x: ExprId) -> ExprId {
    let factors = factors_of(graph, x);
    for (power, n) in &factors {
        let Node::Power { base, exponent } = *graph.node(*power) else {
            continue;
        };
        let mut divisors = factors
            .iter()
            .filter(|(y, m)| divides(graph, base, (*y, *m)));
        let Some((divisor, m)) = divisors.next().copied() else {
            continue;
        };
        let is_number = graph.as_constant(exponent).is_some();
        let is_of_fields = !is_number && graph.inputs_of(exponent).iter().all(is_at_rest);
        if *n != 1 || !is_of_fields || !may_vanish(graph, base) {
            continue;
        }
        let (number, terms) = graph.terms(exponent);
        let exponent = graph.linear(number + Constant::integer(i64::from(m)), &terms);
        let quotient = graph.power(base, exponent);
        let changes = [(*power, -1), (divisor, -m), (quotient, 1)];
        let coefficient = graph.as_multiple(x).0;
        return graph.product(coefficient, &[&factors[..], &changes].concat());
    }
    x
}

/// Whether a factor is a base below, or that of which the base is the absolute value, with an even exponent.
fn divides(graph: &Graph, base: ExprId, (y, n): (ExprId, i32)) -> bool {
    let is_size = matches!(
        graph.node(base),
        Node::Call { function: Function::Abs, arguments } if arguments[..] == [y]
    );
    let is_base = y == base && Norm::of(graph, base).is_none();
    n < 0 && (is_base || (is_size && n % 2 == 0))
}

/// A product with zero in place of powers where numbers n, n − 1, … beside them vanish: with a negative exponent they are infinite at
/// zero.
pub(super) fn where_exponents_vanish(graph: &mut Graph, x: ExprId) -> ExprId {
    let product = graph.as_multiple(x).1;
    let Node::Product(factors) = graph.node(product) else {
        return x;
    };
    let mut kinds = factors.iter().map(|(y, _)| graph.node(*y));
    if !kinds.any(|node| matches!(node, Node::Power { .. })) {
        return x;
    }
    let x = where_whole_exponents_vanish(graph, x);
    where_fields_vanish(graph, x)
}

fn where_whole_exponents_vanish(graph: &mut Graph, x: ExprId) -> ExprId {
    let is_power = |(y, n): &(ExprId, i32)| match graph.node(*y) {
        Node::Power { base, exponent } => {
            *n > 0 && is_whole(graph, *exponent) && moves(graph, *base)
        }
        _ => false,
    };
    let is_number = |(y, n): &(ExprId, i32)| {
        let is_atom = !matches!(graph.node(*y), Node::Power { .. });
        *n > 0 && is_atom && is_whole(graph, *y)
    };
    let (mut numbers, mut powers, mut others) = (Vec::new(), Vec::new(), Vec::new());
    for factor in factors_of(graph, x) {
        if is_number(&factor) {
            numbers.push(factor);
        } else if is_power(&factor) {
            powers.push(factor);
        } else {
            others.push(factor);
        }
    }
    if numbers.is_empty() || powers.is_empty() {
        return x;
    }
    let coefficient = graph.as_multiple(x).0;
    let square = square(graph, &numbers);
    powers.extend(numbers);
    let value = graph.product(Constant::ONE, &powers);
    others.push((zero_where_zero(graph, square, value), 1));
    graph.product(coefficient, &others)
}

/// The same for exponents of fields. The numbers stay beside the power, so that products are rounded as they were.
fn where_fields_vanish(graph: &mut Graph, x: ExprId) -> ExprId {
    let mut factors = factors_of(graph, x);
    let mut is_changed = false;
    for at in 0..factors.len() {
        let (power, n) = factors[at];
        let Some(exponent) = exponent_of_fields(graph, power).filter(|_| n > 0) else {
            continue;
        };
        let mut numbers = Vec::new();
        for (y, m) in &factors {
            let is_power = matches!(graph.node(*y), Node::Power { .. });
            if *m > 0 && !is_power && multiple_of_fields(graph, *y) == Some(exponent) {
                numbers.push((*y, *m));
            }
        }
        if !numbers.is_empty() {
            let square = square(graph, &numbers);
            factors[at].0 = zero_where_zero(graph, square, power);
            is_changed = true;
        }
    }
    if !is_changed {
        return x;
    }
    let coefficient = graph.as_multiple(x).0;
    graph.product(coefficient, &factors)
}

/// The square of a product.
fn square(graph: &mut Graph, factors: &[(ExprId, i32)]) -> ExprId {
    let product = graph.product(Constant::ONE, factors);
    graph.multiply(product, product)
}

/// Zero where a square is zero, and a value elsewhere.
fn zero_where_zero(graph: &mut Graph, square: ExprId, value: ExprId) -> ExprId {
    let zero = graph.constant(Constant::ZERO);
    graph.select(Comparison::LessOrEqual, square, zero, zero, value)
}

/// The multiple in the exponent of a power of something that may vanish: e of x²ᵉ⁻¹. None where the exponent has negative terms only,
/// as in an attraction r⁻ⁿ, which is infinite at zero anyhow.
fn exponent_of_fields(graph: &mut Graph, power: ExprId) -> Option<ExprId> {
    let Node::Power { base, exponent } = *graph.node(power) else {
        return None;
    };
    let is_number = graph.as_constant(exponent).is_some();
    if is_number || is_whole(graph, exponent) || !may_vanish(graph, base) {
        return None;
    }
    let (_, terms) = graph.terms(exponent);
    let may_be_large = terms.iter().any(|(c, _)| !c.is_negative());
    multiple_of_fields(graph, exponent).filter(|_| may_be_large)
}

/// An expression of fields without its number and its factor: e of 2 e − 1.
fn multiple_of_fields(graph: &mut Graph, x: ExprId) -> Option<ExprId> {
    let inputs = graph.inputs_of(x);
    if inputs.is_empty() || !inputs.iter().all(is_at_rest) {
        return None;
    }
    let (_, terms) = graph.terms(x);
    let multiple = graph.linear(Constant::ZERO, &terms);
    Some(graph.as_multiple(multiple).1)
}

/// Whether a base may be zero: not where all that moves in it stands below, and not 1 + x².
fn may_vanish(graph: &Graph, base: ExprId) -> bool {
    let factors = factors_of(graph, base);
    let vanishes = |(y, n): &(ExprId, i32)| *n > 0 && moves(graph, *y) && !is_above_zero(graph, *y);
    is_zero(graph, base) || factors.iter().any(vanishes)
}

/// Whether it is the sum of a positive number and of even powers.
fn is_above_zero(graph: &Graph, x: ExprId) -> bool {
    graph.as_sum(x).is_some_and(|(constant, terms)| {
        let is_square = |(c, y): &(Constant, ExprId)| {
            !c.is_negative() && factors_of(graph, *y).iter().all(|(_, n)| n % 2 == 0)
        };
        !constant.is_zero() && !constant.is_negative() && terms.iter().all(is_square)
    })
}

/// Whether an expression consists of indices and lengths.
fn is_whole(graph: &Graph, x: ExprId) -> bool {
    let inputs = graph.inputs_of(x);
    !inputs.is_empty() && (inputs.iter()).all(|input| matches!(input, Input::Integer(_)))
}
