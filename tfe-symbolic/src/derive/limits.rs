//! Limits of derivatives where their formulas are zero times infinity or zero over zero.
//!
//! ```text
//! m = max(x, 0)        ∂²(m √m)/∂x² = 3/(4 √m) { 1  where x ≥ 0;  0  elsewhere }  →  { 3/(4 √m)  where x ≥ 0;  0  elsewhere }
//! h = √(x² + y²)       ∂²h³/∂x∂y = 3 x y/h                                        →  3 x y/{ 1  where h ≤ 0;  h  elsewhere }
//!                      x ln h                                                     →  x ln { 1  where h ≤ 0;  h  elsewhere }
//! xⁿ                   ∂xⁿ/∂x = n xⁿ⁻¹                                            →  { 0  where n = 0;  n xⁿ⁻¹  elsewhere }
//! ```
//!
//! In a product with a choice between a value and zero, factors that may be infinite are moved into the choice. Norms
//! are treated in `norms.rs`, exponents in `exponents.rs`, exponentials in `exponentials.rs`, inverse functions in `inverse.rs`, sums whose terms have a
//! limit only together in `together.rs`, and products and sums of signs and choices that jump at the same place in `sides.rs`. This is done to the entries as a last step, after factors have been combined, so
//! that m/√m is √m and no choice is needed. Energies and outputs have the limits of norms and of quotients of exponentials
//! only.

mod approach;
mod exponentials;
mod exponents;
mod facts;
mod forms;
mod inverse;
mod lengths;
mod norm;
mod norms;
mod powers;
mod sides;
mod together;

use crate::derive::entry::Entry;
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::rewrite::Mapping;
use crate::program::Array;
use exponentials::{logarithm_where_infinite, over_exponentials, where_exponentials_vanish};
use exponents::{where_exponents_vanish, with_quotients_merged};
use facts::{factors_of, is_surely_positive, is_zero, times_terms};
use inverse::inverse_functions_over_roots;
use lengths::take_limits_where_lengths_vanish;
use norms::Norms;
use sides::take_limits_from_both_sides;
use together::Together;

/// The depth to which factors are searched for values that may be infinite.
const MAX_DEPTH: usize = 4;

/// Rewrites entries so that they have their limits; products without a limit are unchanged.
pub(crate) fn take_limits<'a>(
    graph: &mut Graph,
    lists: impl IntoIterator<Item = &'a mut Vec<Entry>>,
) {
    let (mut derivatives, mut forces, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for entry in lists.into_iter().flatten() {
        match entry.place.array {
            Array::Force => forces.push(entry),
            Array::Value | Array::Observable(_) | Array::SiteObservable => values.push(entry),
            array if is_derivative(array) => derivatives.push(entry),
            _ => {}
        }
    }
    take_limits_from_both_sides(graph, &mut derivatives);
    // The signs in a force are as declared.
    rewrite(
        graph,
        &mut derivatives,
        &mut |graph, old, new| match is_product(graph, old) {
            true => without_squares_of_signs(graph, new),
            false => new,
        },
    );
    let (mut norms, mut together) = (Norms::default(), Together::default());
    let mut slopes = derivatives;
    slopes.append(&mut forces);
    take_limits_where_lengths_vanish(graph, &mut slopes);
    rewrite(graph, &mut slopes, &mut |graph, old, new| {
        if !is_product(graph, old) {
            let new = logarithm_where_infinite(graph, new);
            return together.limit(graph, &mut norms, (old, new));
        }
        let product = with_quotients_merged(graph, new);
        let product = norms.limit(graph, product);
        let product = over_exponentials(graph, product);
        let product = inverse_functions_over_roots(graph, product);
        let product = inside_choices(graph, product);
        let product = where_exponents_vanish(graph, product);
        where_exponentials_vanish(graph, product)
    });
    rewrite(graph, &mut values, &mut |graph, old, new| {
        if !is_product(graph, old) {
            return logarithm_where_infinite(graph, new);
        }
        let product = norms.limit(graph, new);
        over_exponentials(graph, product)
    });
}

fn is_product(graph: &Graph, x: ExprId) -> bool {
    matches!(graph.node(x), Node::Product(_))
}

/// Rewrites the products, sums and logarithms in entries, children first: `limit` is given each of them, and what has become of it by
/// the limits of its children.
fn rewrite(
    graph: &mut Graph,
    entries: &mut [&mut Entry],
    limit: &mut dyn FnMut(&mut Graph, ExprId, ExprId) -> ExprId,
) {
    let roots: Vec<ExprId> = entries.iter().map(|entry| entry.value).collect();
    let mut mapping = Mapping::default();
    for old in graph.reachable(&roots) {
        let node = graph.node(old);
        let may_have_one = matches!(
            node,
            Node::Product(_)
                | Node::Sum { .. }
                | Node::Call {
                    function: Function::Ln,
                    ..
                }
        );
        let keeps = mapping.keeps(node);
        if keeps && !may_have_one {
            continue;
        }
        let mut new = old;
        if !keeps {
            let node = node.clone();
            new = graph.remake(&node, &mapping);
        }
        if may_have_one {
            new = limit(graph, old, new);
        }
        mapping.set(old, new);
    }
    for entry in entries {
        entry.value = mapping.of(entry.value);
    }
}

/// Derivatives of the energy and of forces.
fn is_derivative(array: Array) -> bool {
    matches!(
        array,
        Array::ByZ | Array::ByQ | Array::ZZ | Array::ZQ | Array::QQ | Array::ForceZ | Array::ForceQ
    )
}

/// A derivative f″(|x|) sign²x of a function of |x|, with one for the square of the sign, which it is on both sides of zero; and
/// a sign x + b sign²x for sign x (a + b sign x), as backward sweeps leave it.
fn without_squares_of_signs(graph: &mut Graph, x: ExprId) -> ExprId {
    let mut factors = factors_of(graph, x);
    let mut is_changed = false;
    for (y, n) in &mut factors {
        if is_sign(graph, *y) && *n > 1 {
            *n %= 2;
            is_changed = true;
        }
    }
    let coefficient = graph.as_multiple(x).0;
    if let Some(sum) = sign_and_sum(graph, &factors) {
        return times_sum(graph, coefficient, &factors, sum);
    }
    match is_changed {
        true => graph.product(coefficient, &factors),
        false => x,
    }
}

fn is_sign(graph: &Graph, x: ExprId) -> bool {
    matches!(
        graph.node(x),
        Node::Call {
            function: Function::Sign,
            ..
        }
    )
}

/// A sum among factors of which a term has a sign that is another factor.
fn sign_and_sum(graph: &Graph, factors: &[(ExprId, i32)]) -> Option<ExprId> {
    let signs = factors
        .iter()
        .filter(|(y, n)| *n == 1 && is_sign(graph, *y));
    let signs: Vec<ExprId> = signs.map(|(y, _)| *y).collect();
    let holds = |term: ExprId| {
        let mut own = factors_of(graph, term).into_iter();
        own.any(|(y, n)| n > 0 && signs.contains(&y))
    };
    let mut sums = factors.iter().filter(|(_, n)| *n == 1);
    let sum = sums.find(|(y, _)| {
        let terms = graph.as_sum(*y).map_or(&[][..], |(_, terms)| terms);
        terms.iter().any(|(_, term)| holds(*term))
    })?;
    Some(sum.0)
}

/// The sum of the products of other factors with the terms of a sum among them, without squares of signs.
fn times_sum(
    graph: &mut Graph,
    coefficient: Constant,
    factors: &[(ExprId, i32)],
    sum: ExprId,
) -> ExprId {
    let mut others = factors.to_vec();
    others.retain(|(y, _)| *y != sum);
    let rest = graph.product(coefficient, &others);
    let mut products = times_terms(graph, rest, sum);
    for (_, product) in products.iter_mut().filter(|(_, y)| *y != rest) {
        *product = without_squares_of_signs(graph, *product);
    }
    graph.linear(Constant::ZERO, &products)
}

/// A choice between a value and zero.
#[derive(Clone, Copy)]
struct OrZero {
    comparison: Comparison,
    left: ExprId,
    right: ExprId,
    /// Whether the value is taken where the condition holds.
    holds: bool,
    value: ExprId,
}

impl OrZero {
    /// The choice that a factor is.
    fn of(graph: &Graph, x: ExprId, exponent: i32) -> Option<Self> {
        let Node::Select {
            comparison,
            left,
            right,
            then,
            otherwise,
        } = *graph.node(x)
        else {
            return None;
        };
        let (holds, value) = match (is_zero(graph, then), is_zero(graph, otherwise)) {
            (false, true) => (true, then),
            (true, false) => (false, otherwise),
            _ => return None,
        };
        (exponent > 0).then_some(Self {
            comparison,
            left,
            right,
            holds,
            value,
        })
    }

    fn is_chosen_with(&self, other: &Self) -> bool {
        let key = |choice: &Self| (choice.comparison, choice.left, choice.right, choice.holds);
        key(self) == key(other)
    }

    /// The choice between another value and zero.
    fn with(&self, graph: &mut Graph, value: ExprId) -> ExprId {
        let zero = graph.constant(Constant::ZERO);
        let (then, otherwise) = match self.holds {
            true => (value, zero),
            false => (zero, value),
        };
        graph.select(self.comparison, self.left, self.right, then, otherwise)
    }

    /// Whether the condition and an expression have a leaf in common.
    fn concerns(&self, graph: &Graph, x: ExprId) -> bool {
        let leaves = graph.inputs_of(x);
        let mut held = [self.left, self.right]
            .into_iter()
            .flat_map(|side| graph.inputs_of(side));
        held.any(|leaf| leaves.contains(&leaf))
    }
}

/// A product with factors that may be infinite moved into its choices. The recursion is as deep as the number of
/// choices in it.
fn inside_choices(graph: &mut Graph, x: ExprId) -> ExprId {
    let (coefficient, product) = graph.as_multiple(x);
    let Node::Product(factors) = graph.node(product) else {
        return x;
    };
    let choices = factors
        .iter()
        .filter_map(|(y, n)| OrZero::of(graph, *y, *n));
    let choices: Vec<OrZero> = choices.collect();
    if choices.is_empty() {
        return x;
    }
    let factors = factors.clone();
    for choice in choices {
        let belongs = |(y, n): &(ExprId, i32)| {
            let own = OrZero::of(graph, *y, *n).filter(|own| own.is_chosen_with(&choice))?;
            Some((own.value, *n))
        };
        let diverges = |(y, n): &(ExprId, i32)| {
            may_be_infinite(graph, *y, *n, MAX_DEPTH) && choice.concerns(graph, *y)
        };
        let mut beside = factors.iter().filter(|factor| belongs(factor).is_none());
        if beside.any(diverges) {
            let inside = |factor: &(ExprId, i32)| belongs(factor).unwrap_or(*factor);
            let inside: Vec<(ExprId, i32)> = factors.iter().map(inside).collect();
            let value = graph.product(coefficient, &inside);
            let value = inside_choices(graph, value);
            let value = where_exponents_vanish(graph, value);
            let (number, value) = graph.as_multiple(value);
            let chosen = choice.with(graph, value);
            return graph.scale(number, chosen);
        }
    }
    x
}

/// Whether xⁿ may be infinite where something in it vanishes.
fn may_be_infinite(graph: &Graph, x: ExprId, n: i32, depth: usize) -> bool {
    let Some(depth) = depth.checked_sub(1) else {
        return false;
    };
    let x = graph.as_multiple(x).1;
    match graph.node(x) {
        Node::Call {
            function,
            arguments,
        } => {
            let diverges = match function {
                Function::Sqrt
                | Function::Hypot
                | Function::Abs
                | Function::Min
                | Function::Max => n < 0,
                Function::Ln => n > 0,
                _ => false,
            };
            diverges && !arguments.iter().any(|y| is_surely_positive(graph, *y))
        }
        Node::Select { .. } => n < 0,
        Node::Power { base, exponent } => {
            let diverges = match graph.as_constant(*exponent) {
                Some(exponent) => exponent.is_negative() == (n > 0),
                None => true,
            };
            diverges && !is_surely_positive(graph, *base)
        }
        Node::Product(factors) if n > 0 => {
            (factors.iter()).any(|(y, m)| may_be_infinite(graph, *y, *m, depth))
        }
        Node::Sum { terms, .. } if n > 0 => {
            (terms.iter()).any(|(_, y)| may_be_infinite(graph, *y, 1, depth))
        }
        // The square of a norm.
        Node::Sum { .. } => {
            let root = Node::Call {
                function: Function::Sqrt,
                arguments: vec![x],
            };
            graph.find(&root).is_some() && !is_surely_positive(graph, x)
        }
        _ => false,
    }
}
