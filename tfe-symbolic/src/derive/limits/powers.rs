//! Limits of products in one norm: of those that vanish with it, and of those with powers of it whose exponent is not
//! known.

use super::facts::{argument_of_logarithm, factors_of};
use super::norm::{MAX_DEPTH, MAX_SUMS, Norm};
use crate::expr::comparison::Comparison;
use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};

/// Degrees are sums of exponents, which may have rounding errors.
pub(super) const ROUNDING: f64 = 1e-6;

/// A factor and its exponent.
type Factor = (ExprId, i32);

impl Norm {
    /// The product with this norm replaced by one where both vanish; `None` where the product is unchanged.
    pub(super) fn limit(&self, graph: &mut Graph, factors: &[Factor]) -> Option<ExprId> {
        let base_of = |factor: &Factor| self.base_of_unknown(graph, *factor);
        let bases: Vec<ExprId> = factors.iter().filter_map(base_of).collect();
        if let Some(base) = bases.first().copied() {
            if bases.iter().any(|other| *other != base) {
                return None;
            }
            let (powers, rest): (Vec<Factor>, Vec<Factor>) = factors
                .iter()
                .copied()
                .partition(|factor| self.base_of_unknown(graph, *factor).is_some());
            return self.limit_with_powers(graph, (base, &powers), &rest);
        }
        let mut all = factors.iter();
        let diverges = all.any(|factor| self.diverges(graph, *factor, MAX_SUMS));
        let degree = self.degree_of_product(graph, factors, MAX_DEPTH);
        if !diverges || degree <= ROUNDING {
            return None;
        }
        let mut limit = Vec::with_capacity(factors.len());
        for (x, n) in factors {
            limit.push((self.made_finite(graph, (*x, *n), MAX_SUMS), *n));
        }
        Some(graph.product(Constant::ONE, &limit))
    }

    /// The base of a power of the norm, or of its square, with an exponent that is not known.
    fn base_of_unknown(&self, graph: &Graph, (x, n): Factor) -> Option<ExprId> {
        let Node::Power { base, exponent } = *graph.node(x) else {
            return None;
        };
        let (coefficient, inner) = graph.as_multiple(base);
        let is_own = Some(inner) == self.root || Some(inner) == self.square;
        let is_number = graph.as_constant(exponent).is_some();
        (n > 0 && is_own && !is_number && !coefficient.is_negative()).then_some(base)
    }

    /// A product with powers of this norm. Beside a power that is zero, logarithms of the norm count as zero: hᵉ ln h is smaller than hᵉ⁻ᵟ.
    fn limit_with_powers(
        &self,
        graph: &mut Graph,
        (base, powers): (ExprId, &[Factor]),
        factors: &[Factor],
    ) -> Option<ExprId> {
        let (logarithms, rest): (Vec<Factor>, Vec<Factor>) = factors
            .iter()
            .copied()
            .partition(|factor| self.grows_as_logarithm(graph, *factor));
        let beside_logarithm = !logarithms.is_empty();
        let limit = self.limit_of_powers(graph, (base, powers, beside_logarithm), &rest);
        if logarithms.is_empty() {
            let (powers, rest) = limit?;
            return Some(graph.product(Constant::ONE, &[powers, rest].concat()));
        }
        let is_own = |(x, _): &Factor| self.own_degree(graph, *x, MAX_DEPTH).is_some();
        if limit.is_none() && rest.iter().any(is_own) {
            return None;
        }
        let (powers, rest) = limit.unwrap_or_else(|| (powers.to_vec(), rest));
        let mut size = graph.product(Constant::ONE, &powers);
        if !self.has_parts() {
            // Of a negative number the logarithm is not a number, whatever the power is.
            size = graph.call(Function::Abs, &[size]);
        }
        let zero = graph.constant(Constant::ZERO);
        let replaced = powers.iter().find_map(|(x, _)| match graph.node(*x) {
            Node::Power {
                base: own,
                exponent,
            } if *own != base => Some(*exponent),
            _ => None,
        });
        let mut all = [powers, rest].concat();
        for (x, n) in logarithms {
            let mut finite = graph.select(Comparison::LessOrEqual, size, zero, zero, x);
            if let Some(exponent) = replaced {
                // A power with one in place of the norm is not zero where the product is.
                let at_zero = where_root_vanishes(graph, (exponent, true), [zero, x]);
                finite = graph.select(Comparison::LessOrEqual, base, zero, at_zero, finite);
            }
            all.push((finite, n));
        }
        Some(graph.product(Constant::ONE, &all))
    }

    /// Whether a factor is infinite with the norm by its logarithm alone: ln h, or a sum such as ln h − 1.
    fn grows_as_logarithm(&self, graph: &Graph, (x, n): Factor) -> bool {
        if n < 0 || !self.diverges(graph, (x, n), MAX_SUMS) {
            return false;
        }
        let is_logarithm = |x: ExprId| argument_of_logarithm(graph, x).is_some();
        let Some((_, terms)) = graph.as_sum(x) else {
            return is_logarithm(x);
        };
        let mut factors = terms.iter().flat_map(|(_, term)| factors_of(graph, *term));
        factors.all(|factor| is_logarithm(factor.0) || !self.diverges(graph, factor, MAX_SUMS))
    }

    /// t hᵉ with an exponent that is not known: (t/hᵐ) hᵉ⁺ᵐ with t/hᵐ of degree zero, as the power and the other factors. That is zero, or
    /// infinite, with the power alone. Of several powers e is the sum of the exponents; with m = 0 they stay as they are.
    ///
    /// Of t (h²)ᵉ with t of odd degree, where no root of h² is at hand, one degree is left beside the power.
    fn limit_of_powers(
        &self,
        graph: &mut Graph,
        (base, powers, beside_logarithm): (ExprId, &[Factor], bool),
        factors: &[Factor],
    ) -> Option<(Vec<Factor>, Vec<Factor>)> {
        let inner = graph.as_multiple(base).1;
        let is_root = Some(inner) == self.root;
        let (mut rest, mut shift) = (Vec::new(), 0);
        for (x, n) in factors {
            // In units of the root.
            let unit = if Some(*x) == self.root {
                1
            } else if Some(*x) == self.square {
                2
            } else if self.own_degree(graph, *x, MAX_DEPTH).is_some() {
                return None;
            } else {
                rest.push((*x, *n));
                continue;
            };
            if *x != base && !(self.is_plain && inner == base) {
                return None;
            }
            shift += unit * i64::from(*n);
        }
        let degree = self.degree_of_product(graph, &rest, MAX_DEPTH);
        let above = degree as i64;
        let is_whole = degree == above as f64 && (0..=i64::from(u16::MAX)).contains(&above);
        let is_divided = shift < 0 || (shift == 0 && !is_root && above >= 1);
        if !is_whole || !is_divided {
            return None;
        }
        let is_single = shift == 0 && above == 1;
        if is_single && self.root.is_some() {
            // Beside a root of the norm, as of an attraction, zero is a singular point as a rule.
            return None;
        }
        let root = self.root.filter(|_| self.is_plain && inner == base);
        let (divisor, times, left) = match (is_root, root) {
            (true, _) => (base, above, 0),
            (false, Some(root)) if above % 2 == 1 => (root, above, 0),
            (false, _) => (base, above / 2, above % 2),
        };
        let units = if is_root { 1 } else { 2 };
        let added = Constant::rational(i128::from(shift + above - left), units)?;
        let is_one_power = matches!(powers, [(_, 1)]);
        let powers = match added.is_zero() && left == 0 && !is_one_power {
            true => powers.to_vec(),
            false => {
                let raised = self.raised(
                    graph,
                    (base, powers),
                    added,
                    (left, is_single, beside_logarithm),
                )?;
                vec![(raised, 1)]
            }
        };
        if times > 0 {
            let divisor = self.one_where_zero(graph, divisor);
            rest.push((divisor, -i32::try_from(times).ok()?));
        }
        Some((powers, rest))
    }

    /// The product of powers of one base with a number added to the sum of the exponents. `left` is the degree of what is beside it.
    fn raised(
        &self,
        graph: &mut Graph,
        (base, powers): (ExprId, &[Factor]),
        added: Constant,
        (left, is_single, beside_logarithm): (i64, bool, bool),
    ) -> Option<ExprId> {
        let (number, terms) = sum_of_exponents(graph, powers);
        let number = number + added;
        if left == 0 {
            let exponent = graph.linear(number, &terms);
            return Some(graph.power(base, exponent));
        }
        // A potential (h²)⁻ᵉ has no limit.
        let may_be_large = terms.iter().any(|(c, _)| !c.is_negative());
        if !may_be_large || (is_single && !number.is_negative()) {
            return None;
        }
        let exponent = graph.linear(number, &terms);
        let raised = match number.is_negative() {
            true => {
                let [zero, one] = [0, 1].map(|number| graph.integer(number));
                let at_zero = where_root_vanishes(graph, (exponent, beside_logarithm), [one, zero]);
                self.elsewhere(graph, base, at_zero)
            }
            false => base,
        };
        Some(graph.power(raised, exponent))
    }
}

/// The first of two values where x (h²)ᵉ is zero with h, which is where e is −½ or more, and beside a logarithm more than that; else the second.
fn where_root_vanishes(
    graph: &mut Graph,
    (exponent, beside_logarithm): (ExprId, bool),
    [vanishes, stays]: [ExprId; 2],
) -> ExprId {
    let [one, two] = [1, 2].map(|number| graph.integer(number));
    let half = graph.divide(one, two);
    let least = graph.negate(half);
    let comparison = match beside_logarithm {
        true => Comparison::Less,
        false => Comparison::LessOrEqual,
    };
    graph.select(comparison, least, exponent, vanishes, stays)
}

/// The number and the other terms of the exponent of a product of powers.
fn sum_of_exponents(graph: &Graph, powers: &[Factor]) -> (Constant, Vec<(Constant, ExprId)>) {
    let (mut number, mut terms) = (Constant::ZERO, Vec::new());
    for (power, n) in powers {
        let Node::Power { exponent, .. } = graph.node(*power) else {
            continue;
        };
        let times = Constant::integer(i64::from(*n));
        let (own, others) = graph.terms(*exponent);
        number = number + times * own;
        terms.extend(others.into_iter().map(|(c, x)| (times * c, x)));
    }
    (number, terms)
}
