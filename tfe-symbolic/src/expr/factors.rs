//! Simplification of products whose factors are roots, powers, absolute values and signs.

use crate::expr::constant::Constant;
use crate::expr::function::Function;
use crate::expr::graph::{ExprId, Graph, Node};
use crate::expr::input::Input;
use crate::expr::ordered::SortedMap;

impl Graph {
    /// √x^(2n) → xⁿ, xⁿ/√x → xⁿ⁻¹ √x, abs(x)^(2n) → x^(2n), x sign x → abs x, sinh x/cosh x → tanh x and xᵉ/xⁿ → xᵉ⁻ⁿ;
    /// returns the constant by which the product is to be multiplied.
    pub(super) fn fold_powers(
        &mut self,
        collected: &mut SortedMap<ExprId, i64>,
        waiting: &mut Vec<(ExprId, i64)>,
    ) -> Constant {
        let mut coefficient = self.lift_roots(collected);
        // Roots first: abs(x) sign(x)/√abs(x) is √abs(x) sign(x), and x/√abs(x) would have no value at zero.
        while self.fold_signs(collected) {
            coefficient = coefficient * self.lift_roots(collected);
        }
        self.merge_powers(collected, waiting);
        self.fold_tangents(collected);
        for (x, n) in collected.iter_mut() {
            let Node::Call {
                function,
                arguments,
            } = self.node(*x)
            else {
                continue;
            };
            let Some(&argument) = arguments.first() else {
                continue;
            };
            match function {
                Function::Sqrt if n.abs() >= 2 => {
                    waiting.push((argument, *n / 2));
                    *n %= 2;
                }
                Function::Abs if *n != 0 && *n % 2 == 0 => {
                    waiting.push((argument, *n));
                    *n = 0;
                }
                _ => {}
            }
        }
        coefficient
    }

    /// xⁿ/√x → xⁿ⁻¹ √x for n > 0, x²/√abs(x) → abs(x) √abs(x) and x²/√(c x y) → x √(c x y)/(c y): equal values, and
    /// zero instead of 0/0 where x = 0. Returns the constant by which the product is to be multiplied.
    fn lift_roots(&self, collected: &mut SortedMap<ExprId, i64>) -> Constant {
        let mut coefficient = Constant::ONE;
        let below = |(x, n): &(ExprId, i64)| match self.node(*x) {
            Node::Call {
                function: Function::Sqrt,
                arguments,
            } if *n == -1 => Some((*x, *arguments.first()?)),
            _ => None,
        };
        let roots: Vec<(ExprId, ExprId)> = collected.iter().filter_map(below).collect();
        for (root, argument) in roots {
            if let Some(n) = collected.get_mut(&argument).filter(|n| **n >= 1) {
                *n -= 1;
                *collected.get_or_default(root) = 1;
                continue;
            }
            let Node::Call {
                function: Function::Abs,
                arguments,
            } = self.node(argument)
            else {
                if let Some((multiple, factors)) = self.above_its_root(argument, collected) {
                    for (x, n) in factors {
                        *collected.get_or_default(x) -= i64::from(n);
                    }
                    *collected.get_or_default(root) = 1;
                    coefficient = coefficient * multiple;
                }
                continue;
            };
            let squared = arguments.first().copied();
            if let Some(factors) = squared.and_then(|x| self.standing_among(x, 2, collected)) {
                for (x, n) in factors {
                    *collected.get_or_default(x) -= n;
                }
                *collected.get_or_default(argument) += 1;
                *collected.get_or_default(root) = 1;
            }
        }
        coefficient
    }

    /// x sign x → abs x and abs(x) sign x → x; even powers of a sign beside them, or beside abs(x)ᵉ, → 1. Returns
    /// whether there was such a factor.
    fn fold_signs(&mut self, collected: &mut SortedMap<ExprId, i64>) -> bool {
        let sign_of = |(x, n): &(ExprId, i64)| match self.node(*x) {
            Node::Call {
                function: Function::Sign,
                arguments,
            } if *n > 0 => Some((*x, *n, *arguments.first()?)),
            _ => None,
        };
        let signs: Vec<(ExprId, i64, ExprId)> = collected.iter().filter_map(sign_of).collect();
        let mut is_folded = false;
        for (sign, n, argument) in signs {
            let size = Node::Call {
                function: Function::Abs,
                arguments: vec![argument],
            };
            let stands = |size: &ExprId| collected.get(size).is_some_and(|m| *m > 0);
            let known = self.find(&size);
            let beside = known.filter(stands);
            let is_power = |(x, m): &(ExprId, i64)| match self.node(*x) {
                Node::Power { base, .. } => *m > 0 && Some(self.as_multiple(*base).1) == known,
                _ => false,
            };
            if n > 1 && beside.is_none() && collected.iter().any(is_power) {
                // The square of a sign is one also where x = 0: abs(x)ᵉ sign² is the second derivative of a power, of
                // which the limit is meant.
                *collected.get_or_default(sign) = n % 2;
                is_folded = true;
                continue;
            }
            if let Some(size) = beside {
                if n % 2 != 0 {
                    *collected.get_or_default(size) -= 1;
                    for (x, m) in self.factors_of(argument) {
                        *collected.get_or_default(x) += m;
                    }
                }
            } else if let Some(factors) = self.standing_among(argument, 1, collected) {
                if n % 2 != 0 {
                    for (x, m) in factors {
                        *collected.get_or_default(x) -= m;
                    }
                    let size = self.call(Function::Abs, &[argument]);
                    *collected.get_or_default(size) += 1;
                }
            } else {
                continue;
            }
            *collected.get_or_default(sign) = 0;
            is_folded = true;
        }
        is_folded
    }

    /// sinh x/cosh x → tanh x, which is finite where both are infinite.
    fn fold_tangents(&mut self, collected: &mut SortedMap<ExprId, i64>) {
        let below = |(x, n): &(ExprId, i64)| match self.node(*x) {
            Node::Call {
                function: Function::Cosh,
                arguments,
            } if *n < 0 => Some((*x, *n, arguments.clone())),
            _ => None,
        };
        let cosines: Vec<(ExprId, i64, Vec<ExprId>)> = collected.iter().filter_map(below).collect();
        for (cosine, n, arguments) in cosines {
            let sine = Node::Call {
                function: Function::Sinh,
                arguments: arguments.clone(),
            };
            let Some(sine) = self.find(&sine) else {
                continue;
            };
            let above = collected.get(&sine).copied().unwrap_or_default();
            let times = above.min(n.saturating_neg());
            if times > 0 {
                *collected.get_or_default(sine) -= times;
                *collected.get_or_default(cosine) += times;
                let tangent = self.call(Function::Tanh, &arguments);
                *collected.get_or_default(tangent) += times;
            }
        }
    }

    /// xᵉ/xⁿ → xᵉ⁻ⁿ for a number e that is not whole, and (c x)ᵉ xⁿ → (c x)ᵉ⁺ⁿ/cⁿ where e is below zero, or e − 1 and the like: the same numbers, and the limit at zero.
    fn merge_powers(
        &mut self,
        collected: &mut SortedMap<ExprId, i64>,
        waiting: &mut Vec<(ExprId, i64)>,
    ) {
        let power_of = |(x, n): &(ExprId, i64)| match self.node(*x) {
            Node::Power { base, exponent } if *n > 0 => {
                let number = self.as_constant(*exponent);
                let is_whole = number.is_some_and(|number| number.as_integer().is_some());
                (!is_whole).then_some((*x, *n, *base, *exponent))
            }
            _ => None,
        };
        let powers: Vec<(ExprId, i64, ExprId, ExprId)> =
            collected.iter().filter_map(power_of).collect();
        for (power, n, base, exponent) in powers {
            let (scale, x) = self.as_multiple(base);
            let beside = collected.get(&x).copied().unwrap_or_default();
            if beside == 0 {
                continue;
            }
            let number = self.as_constant(exponent);
            let (own, terms) = match number {
                Some(number) => (number * Constant::integer(n), Vec::new()),
                None => self.terms(exponent),
            };
            let is_merged = match number {
                Some(_) if beside < 0 => scale.is_one(),
                _ => {
                    let is_one_power = number.is_some() || n == 1;
                    beside > 0 && is_one_power && own.is_negative() && self.may_vanish(x)
                }
            };
            if is_merged {
                *collected.get_or_default(x) = 0;
                *collected.get_or_default(power) = 0;
                let exponent = self.linear(own + Constant::integer(beside), &terms);
                waiting.push((self.power(base, exponent), 1));
                if !scale.is_one() {
                    waiting.push((self.constant(scale), -beside));
                }
            }
        }
    }

    /// Whether it can be zero; parameters cannot, because they count as positive.
    pub(super) fn may_vanish(&self, x: ExprId) -> bool {
        !matches!(
            self.node(x),
            Node::Input(Input::Parameter(_) | Input::ParameterElement(..))
        )
    }

    /// The factors of an expression with their exponents.
    fn factors_of(&self, x: ExprId) -> Vec<(ExprId, i64)> {
        match self.node(x) {
            Node::Product(factors) => factors.iter().map(|(x, n)| (*x, i64::from(*n))).collect(),
            _ => vec![(x, 1)],
        }
    }

    /// The factors of this power of an expression, if all of them stand among others.
    fn standing_among(
        &self,
        x: ExprId,
        power: i64,
        others: &SortedMap<ExprId, i64>,
    ) -> Option<Vec<(ExprId, i64)>> {
        let mut factors = self.factors_of(x);
        for (_, n) in &mut factors {
            *n = n.saturating_mul(power);
        }
        let stands = |(x, n): &(ExprId, i64)| {
            let here = others.get(x).copied().unwrap_or_default();
            if *n > 0 { here >= *n } else { here <= *n }
        };
        factors.iter().all(stands).then_some(factors)
    }

    /// 1/c and the factors of an argument c Π xᵢ^mᵢ of a root, if all that stand above in it are among other factors as often, and one may vanish.
    fn above_its_root(
        &self,
        argument: ExprId,
        collected: &SortedMap<ExprId, i64>,
    ) -> Option<(Constant, Vec<(ExprId, i32)>)> {
        let (multiple, inner) = self.as_multiple(argument);
        let factors = match self.node(inner) {
            Node::Product(factors) => factors.clone(),
            _ => vec![(inner, 1)],
        };
        let mut above = factors.iter().filter(|(_, n)| *n > 0);
        let stands_above = |(x, n): &(ExprId, i32)| {
            let here = collected.get(x).copied().unwrap_or_default();
            here >= i64::from(*n)
        };
        let may_vanish = |(x, _): &(ExprId, i32)| self.may_vanish(*x);
        if !above.clone().all(stands_above) || !above.any(may_vanish) {
            return None;
        }
        Some((multiple.reciprocal()?, factors))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::simplify::tests::{number, variables};

    #[test]
    fn signs_and_sizes() {
        let (mut g, x, y, _) = variables();
        let two = g.integer(2);
        let [size, sign] = [Function::Abs, Function::Sign].map(|f| g.call(f, &[x]));
        assert_eq!(g.multiply(x, sign), size);
        assert_eq!(g.multiply(size, sign), x);
        let twice = g.multiply(two, x);
        assert_eq!(g.call(Function::Sign, &[twice]), sign);
        let double = g.multiply(two, size);
        assert_eq!(g.call(Function::Abs, &[twice]), double);
        // x² sign(x)/√abs(x) = x √abs(x), and of x/y the same
        let quotient = g.divide(x, y);
        for x in [x, quotient] {
            let [size, sign] = [Function::Abs, Function::Sign].map(|f| g.call(f, &[x]));
            let root = g.call(Function::Sqrt, &[size]);
            let product = g.product(Constant::ONE, &[(x, 2), (sign, 1), (root, -1)]);
            assert_eq!(product, g.multiply(x, root));
            let product = g.product(Constant::ONE, &[(x, 1), (sign, 1), (root, -1)]);
            assert_eq!(product, root);
        }
        let alone = g.multiply(y, sign);
        assert_eq!(g.display(alone).to_string(), "y*sign(x)");
    }

    #[test]
    fn quotients_of_hyperbolic_functions() {
        let (mut g, x, y, _) = variables();
        let [sine, cosine, tangent] =
            [Function::Sinh, Function::Cosh, Function::Tanh].map(|f| g.call(f, &[x]));
        assert_eq!(g.divide(sine, cosine), tangent);
        let product = g.product(Constant::ONE, &[(sine, 1), (cosine, -3), (y, 1)]);
        let expected = g.product(Constant::ONE, &[(tangent, 1), (cosine, -2), (y, 1)]);
        assert_eq!(product, expected);
        let other = g.call(Function::Cosh, &[y]);
        let quotient = g.divide(sine, other);
        assert_eq!(g.display(quotient).to_string(), "sinh(x)*cosh(y)^(-1)");
    }

    #[test]
    fn powers_and_quotients_merge() {
        let (mut g, x, ..) = variables();
        let [large, small] = ["1.3", "-1.7"].map(|text| number(&mut g, text));
        let [power, expected] = [large, small].map(|exponent| g.power(x, exponent));
        let below = g.product(Constant::ONE, &[(power, 1), (x, -3)]);
        assert_eq!(below, expected);
        assert_ne!(g.multiply(power, x), power);
    }
}
