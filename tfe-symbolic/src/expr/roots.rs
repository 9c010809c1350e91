//! Square roots of what has a simpler one.

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::sums::{factors_of, quotient};

/// In longer sums no term is sought that divides the others.
const LONG_SUM: usize = 8;

impl Graph {
    /// arccos(cos u) with the digits that cos u has no more near its extrema, and with the slope ±1.
    pub(super) fn angle_of_cosine(&mut self, cosine: ExprId) -> Option<ExprId> {
        let Node::Call {
            function: Function::Cos,
            arguments,
        } = self.node(cosine)
        else {
            return None;
        };
        let u = arguments.clone();
        let sine = self.call(Function::Sin, &u);
        let angle = self.call(Function::Atan2, &[sine, cosine]);
        let sign = self.call(Function::Sign, &[sine]);
        Some(self.multiply(sign, angle))
    }

    /// Whether it is a sum of even powers with positive coefficients.
    pub(super) fn is_sum_of_squares(&self, x: ExprId) -> bool {
        let is_square = |y: ExprId| matches!(self.node(y), Node::Product(factors) if factors.iter().all(|(_, n)| n % 2 == 0));
        self.as_sum(x).is_some_and(|(constant, terms)| {
            let mut terms = terms.iter();
            !constant.is_negative() && terms.all(|(c, y)| !c.is_negative() && is_square(*y))
        })
    }

    /// √x, where that is not just the function of x.
    pub(super) fn simpler_root(&mut self, x: ExprId) -> Option<ExprId> {
        if let Some(half) = self.root_of_square(x) {
            return Some(self.call(Function::Abs, &[half]));
        }
        if let Some(halved) = self.with_halved_angles(x) {
            return Some(self.call(Function::Sqrt, &[halved]));
        }
        self.root_of_multiples(x)
    }

    /// y of x = y², where that is a number times even powers.
    fn root_of_square(&mut self, x: ExprId) -> Option<ExprId> {
        let (coefficient, inner) = self.as_multiple(x);
        let Node::Product(factors) = self.node(inner) else {
            return None;
        };
        if factors.iter().any(|(_, n)| n % 2 != 0) {
            return None;
        }
        let halves: Vec<(ExprId, i32)> = factors.iter().map(|(x, n)| (*x, n / 2)).collect();
        Some(self.product(coefficient.exact_sqrt()?, &halves))
    }

    /// The product x with 2 sin²(u/2) for 1 − cos u, and likewise for 1 + cos u and cosh u − 1: these are not rounded to
    /// zero beside the zero of the root, where it has a kink.
    fn with_halved_angles(&mut self, x: ExprId) -> Option<ExprId> {
        let (mut coefficient, inner) = self.as_multiple(x);
        let mut factors = factors_of(self, inner);
        let mut is_changed = false;
        for (y, n) in &mut factors {
            if *n % 2 == 0 {
                continue;
            }
            if let Some((number, root)) = self.square_of_half(*y) {
                coefficient = coefficient * number.powi(*n)?;
                (*y, *n) = (root, 2 * *n);
                is_changed = true;
            }
        }
        (is_changed && !coefficient.is_negative()).then(|| self.product(coefficient, &factors))
    }

    /// c and y with c y² for 1 − cos u and the like.
    fn square_of_half(&mut self, x: ExprId) -> Option<(Constant, ExprId)> {
        let (constant, terms) = self.as_sum(x)?;
        let [(c, y)] = terms[..] else {
            return None;
        };
        let Node::Call {
            function,
            arguments,
        } = self.node(y)
        else {
            return None;
        };
        let (of_half, c) = match function {
            Function::Cos if c == -constant => (Function::Sin, constant),
            Function::Cos if c == constant => (Function::Cos, constant),
            Function::Cosh if c == -constant => (Function::Sinh, c),
            _ => return None,
        };
        let angle = *arguments.first()?;
        let half = self.scale(Constant::rational(1, 2)?, angle);
        let root = self.call(of_half, &[half]);
        Some((Constant::integer(2) * c, root))
    }

    /// x² √(1 + x²) of x⁴ + x⁶: the root of a term that divides the others, where that is smooth, comes out.
    fn root_of_multiples(&mut self, x: ExprId) -> Option<ExprId> {
        let (coefficient, inner) = self.as_multiple(x);
        let (constant, terms) = self.as_sum(inner)?;
        let is_positive = |c: Constant| !c.is_zero() && !c.is_negative();
        let are_positive = is_positive(coefficient) && terms.iter().all(|(c, _)| is_positive(*c));
        if !constant.is_zero() || !are_positive || terms.len() > LONG_SUM {
            return None;
        }
        let terms = terms.to_vec();
        let divisor = terms
            .iter()
            .map(|(_, y)| factors_of(self, *y))
            .find(|divisor| {
                let has_root = |(y, n): &(ExprId, i32)| *n > 0 && n % 4 == 0 && self.may_vanish(*y);
                divisor.iter().all(has_root)
                    && terms.iter().all(|(_, y)| {
                        let rest = quotient(&factors_of(self, *y), divisor);
                        rest.is_some_and(|rest| rest.iter().all(|(_, n)| n % 2 == 0))
                    })
            })?;
        let mut quotients = Vec::with_capacity(terms.len());
        for (c, y) in terms {
            let rest = quotient(&factors_of(self, y), &divisor)?;
            quotients.push((coefficient * c, self.product(Constant::ONE, &rest)));
        }
        let sum = self.linear(Constant::ZERO, &quotients);
        let root = self.call(Function::Sqrt, &[sum]);
        let mut factors: Vec<(ExprId, i32)> = divisor.iter().map(|(y, n)| (*y, n / 2)).collect();
        factors.push((root, 1));
        Some(self.product(Constant::ONE, &factors))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::input::{Affine, Input};

    #[test]
    fn roots_of_sums() {
        let mut g = Graph::default();
        let [x, y] = [0, 1].map(|k| g.input(Input::Coordinate(Affine::constant(k))));
        let root = |g: &mut Graph, terms: &[(i64, i32, i32)]| {
            let mut sum = Vec::new();
            for (c, m, n) in terms {
                let term = g.product(Constant::ONE, &[(x, *m), (y, *n)]);
                sum.push((Constant::integer(*c), term));
            }
            let sum = g.linear(Constant::ZERO, &sum);
            let root = g.call(Function::Sqrt, &[sum]);
            g.display(root).to_string()
        };
        assert_eq!(
            root(&mut g, &[(1, 4, 0), (1, 6, 0)]),
            "q[0]^2*sqrt((q[0]^2) + 1)"
        );
        assert_eq!(
            root(&mut g, &[(1, 4, 2), (3, 4, 0)]),
            "q[0]^2*sqrt((q[1]^2) + 3)"
        );
        // The first has a kink, and no term of the second divides the other.
        for terms in [[(1, 2, 0), (1, 4, 0)], [(1, 4, 0), (1, 0, 4)]] {
            assert!(root(&mut g, &terms).starts_with("sqrt("), "{terms:?}");
        }
    }

    #[test]
    fn roots_with_half_angles() {
        let mut g = Graph::default();
        let x = g.input(Input::Coordinate(Affine::constant(0)));
        let one = g.integer(1);
        let root = |g: &mut Graph, function: Function, is_added: bool| {
            let value = g.call(function, &[x]);
            let sum = match is_added {
                true => g.add(one, value),
                false => g.subtract(one, value),
            };
            let root = g.call(Function::Sqrt, &[sum]);
            g.display(root).to_string()
        };
        assert_eq!(
            root(&mut g, Function::Cos, false),
            "sqrt(2*(sin(0.5*q[0])^2))"
        );
        assert_eq!(
            root(&mut g, Function::Cos, true),
            "sqrt(2*(cos(0.5*q[0])^2))"
        );
        // Of a negative number there is no root.
        assert_eq!(
            root(&mut g, Function::Cosh, false),
            "sqrt(-(cosh(q[0]) - 1))"
        );
        let [value, four] = [g.call(Function::Cosh, &[x]), g.integer(4)];
        let less = g.subtract(value, one);
        let scaled = g.multiply(four, less);
        let root = g.call(Function::Sqrt, &[scaled]);
        assert_eq!(g.display(root).to_string(), "sqrt(8*(sinh(0.5*q[0])^2))");
    }
}
