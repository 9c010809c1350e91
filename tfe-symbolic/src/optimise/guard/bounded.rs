//! Numbers with a bound of their rounding error: a running error analysis, to first order.
//!
//! ```text
//! |computed − exact| ≤ error · 2⁻⁵³ (1 + small)        fl(a + b): error_a + error_b + |a + b|
//! ```
//!
//! Inputs and numbers are exact. Each operation adds half an ulp of its result, a function a whole one; an operation whose result is exact at the
//! numbers at hand, such as the difference of two that are close, adds nothing.

use crate::expr::comparison::Comparison;
use crate::expr::function::Function;

/// A value and the bound of its error, in units of 2⁻⁵³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounded {
    pub(crate) value: f64,
    pub(crate) error: f64,
    /// The bound of the error of the square root, where that is smaller than what follows from `error`: √(a²) is |a| to the last digit.
    root_error: Option<f64>,
}

impl Bounded {
    /// What is given.
    pub(crate) fn exact(value: f64) -> Self {
        Self::new(value, 0.0)
    }

    fn new(value: f64, error: f64) -> Self {
        Self {
            value,
            error,
            root_error: None,
        }
    }

    /// The result of an operation whose operands bring this error.
    fn rounded(value: f64, error: f64) -> Self {
        Self::new(value, error + value.abs())
    }

    /// The result of an operation that is exact, or rounded.
    fn rounded_unless(is_exact: bool, value: f64, error: f64) -> Self {
        match is_exact {
            true => Self::new(value, error),
            false => Self::rounded(value, error),
        }
    }

    /// a + b
    pub(crate) fn plus(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let sum = a + b;
        let part = sum - a;
        let rest = (a - (sum - part)) + (b - part);
        let result = Self::rounded_unless(rest == 0.0, sum, self.error + other.error);
        let root_error = match (sum == a, sum == b) {
            (true, _) => self.root_error_beside(other),
            (_, true) => other.root_error_beside(self),
            _ => None,
        };
        Self {
            root_error,
            ..result
        }
    }

    /// The bound of the error of the square root of a sum that is this number, with a term that is too small to change it.
    fn root_error_beside(self, small: Self) -> Option<f64> {
        let left_out = small.value.abs() * (2.0 / f64::EPSILON) + small.error;
        Some(self.root_error? + left_out / (2.0 * self.value.sqrt()))
    }

    /// −a
    pub(crate) fn negated(self) -> Self {
        Self::new(-self.value, self.error)
    }

    /// a b
    pub(crate) fn times(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let error = self.error * b.abs() + a.abs() * other.error;
        let product = a * b;
        let is_square = a == b && self.error == other.error;
        Self {
            root_error: is_square.then_some(self.error),
            ..Self::rounded_unless(a.mul_add(b, -product) == 0.0, product, error)
        }
    }

    /// c a, without rounding where c is a power of two
    pub(crate) fn scaled(self, factor: f64, is_exact: bool) -> Self {
        if factor == 1.0 {
            return self;
        }
        let product = Self::new(factor * self.value, factor.abs() * self.error);
        match is_exact {
            true => product,
            false => Self::rounded(product.value, product.error),
        }
    }

    /// a / b
    pub(crate) fn over(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let quotient = a / b;
        let error = self.error / b.abs() + quotient.abs() * other.error / b.abs();
        Self::rounded_unless(quotient.mul_add(b, -a) == 0.0, quotient, error)
    }

    /// aⁿ by products; n > 0
    pub(crate) fn to_the(self, exponent: u32) -> Self {
        let n = i32::try_from(exponent).unwrap_or(i32::MAX);
        let value = self.value.powi(n);
        let slope = f64::from(exponent) * self.value.powi(n - 1).abs();
        let error = slope * self.error + f64::from(exponent - 1) * value.abs();
        Self {
            root_error: (exponent == 2).then_some(self.error),
            ..Self::new(value, error)
        }
    }

    /// a^b by the function of that name
    pub(crate) fn power(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let value = a.powf(b);
        let by_exponent = match other.error > 0.0 {
            true => (value * a.ln()).abs() * other.error,
            false => 0.0,
        };
        let error = (b * a.powf(b - 1.0)).abs() * self.error + by_exponent;
        Self::rounded(value, error + value.abs())
    }

    /// A function of arguments.
    pub(crate) fn call(function: Function, arguments: &[Self]) -> Self {
        let values: Vec<f64> = arguments.iter().map(|argument| argument.value).collect();
        let value = function.evaluate(&values);
        let of = |at: usize| arguments.get(at).copied().unwrap_or(Self::exact(f64::NAN));
        let (x, y) = (of(0), of(1));
        let v = x.value;
        let slope = match function {
            // These choose, or drop a sign: nothing is rounded.
            Function::Min | Function::Max => {
                let first = function.takes_first().holds(x.value, y.value);
                return if first { x } else { y };
            }
            Function::Abs => {
                return Self::new(value, x.error);
            }
            Function::Sign => return Self::exact(value),
            Function::Atan2 | Function::Hypot => {
                let size = x.value.hypot(y.value);
                let below = if function == Function::Hypot {
                    size
                } else {
                    size * size
                };
                let (by_x, by_y) = match function {
                    Function::Hypot => (x.value / below, y.value / below),
                    _ => (y.value / below, x.value / below),
                };
                let error = by_x.abs() * x.error + by_y.abs() * y.error;
                return Self::rounded(value, error + value.abs());
            }
            Function::Sin => v.cos(),
            Function::Cos => v.sin(),
            Function::Tan => 1.0 + value * value,
            Function::Asin | Function::Acos => ((1.0 - v) * (1.0 + v)).sqrt().recip(),
            Function::Atan => (1.0 + v * v).recip(),
            Function::Sinh => v.cosh(),
            Function::Cosh => v.sinh(),
            Function::Tanh => (1.0 - value) * (1.0 + value),
            Function::Asinh => v.hypot(1.0).recip(),
            Function::Acosh => ((v - 1.0) * (v + 1.0)).sqrt().recip(),
            Function::Atanh => ((1.0 - v) * (1.0 + v)).recip(),
            Function::Exp => value,
            Function::Ln => v.recip(),
            Function::Sqrt => 0.5 / value,
        };
        let is_exact = match function {
            Function::Sqrt => value.mul_add(value, -v) == 0.0,
            Function::Acos | Function::Acosh | Function::Ln => v == 1.0,
            // The cosine of equal angles may follow from those of the angles.
            Function::Cos => false,
            _ => v == 0.0,
        };
        if let (Function::Sqrt, Some(error)) = (function, x.root_error) {
            return Self::new(value, error);
        }
        let error = match x.error > 0.0 {
            true => slope.abs() * x.error,
            false => 0.0,
        };
        match is_exact {
            true => Self::new(value, error),
            false => Self::rounded(value, error + value.abs()),
        }
    }

    /// The branch of a choice.
    pub(crate) fn select(
        comparison: Comparison,
        [left, right, then, otherwise]: [Self; 4],
    ) -> Self {
        if comparison.holds(left.value, right.value) {
            then
        } else {
            otherwise
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cancellation_shows_in_the_bound() {
        let (x, y) = (Bounded::exact(1e6 + 0.1), Bounded::exact(1e6 + 0.7));
        let difference = x.plus(y.negated());
        assert_eq!(difference.error, 0.0, "close numbers");
        assert!(x.plus(Bounded::exact(0.7)).error > 1e6);
        // x² − y² by squares and by the difference
        let squares = x.to_the(2).plus(y.to_the(2).negated());
        let product = difference.times(x.plus(y));
        assert!(squares.error > 1e5 * product.error);
    }

    #[test]
    fn roots_of_squares_are_exact() {
        let root = |square: Bounded| Bounded::call(Function::Sqrt, &[square]);
        let (x, small) = (Bounded::exact(0.1), Bounded::exact(1e-12));
        assert_eq!(root(x.to_the(2)).error, 0.0);
        assert_eq!(root(x.times(x)).error, 0.0);
        assert!(root(x.to_the(2).plus(small.times(small))).error < 1e-3 * x.value);
        assert!(root(x.times(small)).error > 0.0);
    }

    #[test]
    fn bounds_hold_for_what_is_computed() {
        // Exact values of sin and exp at a rounded argument follow from the derivative.
        for k in 1..200 {
            let x = Bounded::exact(f64::from(k) * 0.037);
            let third = x.over(Bounded::exact(3.0));
            let sine = Bounded::call(Function::Sin, &[third]);
            assert!(sine.error <= third.error + 2.0 * sine.value.abs());
            let power = third.power(Bounded::exact(2.5));
            let products = third
                .to_the(2)
                .times(Bounded::call(Function::Sqrt, &[third]));
            let apart = (power.value - products.value).abs();
            assert!(apart <= (power.error + products.error) * f64::EPSILON / 2.0);
        }
    }
}
