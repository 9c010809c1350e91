//! Sums that may cancel without an earlier rounding error: they keep the order in which they are written.
//!
//! The terms of most sums have rounding errors already, so that the sum may be evaluated in any order: no order loses
//! more than the rounding of the largest term. Inputs and constants are exact. In x − y + z with x ≈ y the difference
//! is exact, whereas x + z − y would lose the digits of z below an ulp of x. The same holds for a nested sum: (x − y) +
//! (z − w) is not x + z − y − w.

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;

/// The depth to which arguments of `abs`, `min`, `max` and branches of `select` are examined; deeper ones count as
/// rounded.
const MAX_DEPTH: usize = 8;

/// What is known of the sign of an exact term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sign {
    Positive,
    Negative,
    Any,
}

impl Sign {
    fn times(self, factor: Constant) -> Self {
        match (self, factor.is_negative()) {
            (Self::Positive, true) => Self::Negative,
            (Self::Negative, true) => Self::Positive,
            (sign, _) => sign,
        }
    }
}

impl Graph {
    /// Whether a sum has two exact terms that may have opposite signs, so that it is evaluated in the given order and
    /// is not merged into another sum.
    ///
    /// Parameters count as positive: sums of masses may be taken in any order.
    pub(crate) fn keeps_order(&self, id: ExprId) -> bool {
        let Some((constant, terms)) = self.as_sum(id) else {
            return false;
        };
        self.may_cancel_exactly(constant, terms)
    }

    /// The same for `constant + Σ c x`.
    pub(crate) fn may_cancel_exactly(
        &self,
        constant: Constant,
        terms: &[(Constant, ExprId)],
    ) -> bool {
        let number = (!constant.is_zero()).then(|| Sign::Positive.times(constant));
        let exact = terms.iter().filter_map(|(c, x)| {
            let sign = self.sign_if_exact(*x, MAX_DEPTH)?;
            c.is_power_of_two().then(|| sign.times(*c))
        });
        let signs: Vec<Sign> = number.into_iter().chain(exact).collect();
        signs.len() > 1
            && signs
                .iter()
                .any(|sign| *sign == Sign::Any || *sign != signs[0])
    }

    /// The group of a term in a sum that keeps its order: the terms of one group are added first. Coordinates are near
    /// coordinates, and parameters near parameters: their sums cancel before digits are rounded away.
    pub(crate) fn group_of_term(&self, id: ExprId) -> usize {
        match self.node(id) {
            Node::Input(Input::Parameter(_) | Input::ParameterElement(..)) => 2,
            Node::Input(Input::Velocity(_) | Input::Momentum(_)) => 1,
            Node::Input(_) => 0,
            _ => 3,
        }
    }

    /// The sign of an expression without a rounding error; `None` where it has one.
    fn sign_if_exact(&self, id: ExprId, depth: usize) -> Option<Sign> {
        let depth = depth.checked_sub(1)?;
        match self.node(id) {
            Node::Constant(value) => Some(Sign::Positive.times(*value)),
            Node::Input(Input::Parameter(_) | Input::ParameterElement(..) | Input::Integer(_)) => {
                Some(Sign::Positive)
            }
            Node::Input(_) => Some(Sign::Any),
            // A sum of exact terms may be exact.
            Node::Sum { constant, terms } => {
                let number = (!constant.is_zero()).then_some(Some(Sign::Positive.times(*constant)));
                let signs = terms.iter().map(|(c, x)| {
                    let sign = self.sign_if_exact(*x, depth)?;
                    c.is_power_of_two().then(|| sign.times(*c))
                });
                common(number.into_iter().chain(signs))
            }
            Node::Call {
                function: Function::Abs,
                arguments,
            } => {
                self.sign_if_exact(*arguments.first()?, depth)?;
                Some(Sign::Positive)
            }
            Node::Call {
                function: Function::Min | Function::Max,
                arguments,
            } => self.common_sign(arguments, depth),
            Node::Select {
                then, otherwise, ..
            } => self.common_sign(&[*then, *otherwise], depth),
            _ => None,
        }
    }

    fn common_sign(&self, all: &[ExprId], depth: usize) -> Option<Sign> {
        common(all.iter().map(|x| self.sign_if_exact(*x, depth)))
    }
}

/// The sign that all have.
fn common(mut signs: impl Iterator<Item = Option<Sign>>) -> Option<Sign> {
    let first = signs.next()??;
    signs.try_fold(first, |known, sign| {
        Some(if sign? == known { known } else { Sign::Any })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::input::Affine;

    fn variables(graph: &mut Graph) -> [ExprId; 4] {
        let q = [0, 1].map(|k| graph.input(Input::Coordinate(Affine::constant(k))));
        let p = ["a", "b"].map(|name| graph.input(Input::Parameter(name.to_owned())));
        [q[0], q[1], p[0], p[1]]
    }

    #[test]
    fn sums_of_inputs_keep_their_order() {
        let mut g = Graph::default();
        let [x, y, a, b] = variables(&mut g);
        let size = g.call(Function::Abs, &[x]);
        for (first, second, kept) in [(x, y, true), (x, a, true), (a, b, false), (size, a, false)] {
            let (sum, difference) = (g.add(first, second), g.subtract(first, second));
            // |x| − a is −(a − |x|).
            let difference = g.as_multiple(difference).1;
            assert_eq!(g.keeps_order(sum), kept);
            assert!(g.keeps_order(difference));
        }
    }

    #[test]
    fn rounded_terms_may_be_taken_in_any_order() {
        let mut g = Graph::default();
        let [x, y, a, b] = variables(&mut g);
        let (ax, by) = (g.multiply(a, x), g.multiply(b, y));
        for sum in [g.subtract(ax, by), g.subtract(ax, y), g.add(by, x)] {
            assert!(!g.keeps_order(sum));
        }
        // 3 x is rounded, 2 x is not.
        let (two, three) = (g.integer(2), g.integer(3));
        let (double, triple) = (g.multiply(two, x), g.multiply(three, x));
        let sums = [g.subtract(double, y), g.subtract(triple, y)];
        assert_eq!(sums.map(|sum| g.keeps_order(sum)), [true, false]);
    }
}
