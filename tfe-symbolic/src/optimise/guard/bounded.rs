//! Numbers with a bound of their rounding error: a running error analysis, to first order.
//!
//! ```text
//! |computed − exact| ≤ error · 2⁻⁵³ (1 + small)        fl(a + b): error_a + error_b + |a + b|
//! ```
//!
//! Inputs and numbers are exact. Each operation adds half an ulp of its result, a function a whole one.

use crate::expr::comparison::Comparison;
use crate::expr::function::Function;

/// A value and the bound of its error, in units of 2⁻⁵³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounded {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

impl Bounded {
    /// What is given.
    pub(crate) fn exact(value: f64) -> Self {
        Self { value, error: 0.0 }
    }

    /// The result of an operation whose operands bring this error.
    fn rounded(value: f64, error: f64) -> Self {
        Self {
            value,
            error: error + value.abs(),
        }
    }

    /// a + b
    pub(crate) fn plus(self, other: Self) -> Self {
        let error = self.error + other.error;
        // Nothing is rounded where one of both is zero.
        if self.value == 0.0 || other.value == 0.0 {
            return Self {
                value: self.value + other.value,
                error,
            };
        }
        Self::rounded(self.value + other.value, error)
    }

    /// −a
    pub(crate) fn negated(self) -> Self {
        Self {
            value: -self.value,
            ..self
        }
    }

    /// a b
    pub(crate) fn times(self, other: Self) -> Self {
        let error = self.error * other.value.abs() + self.value.abs() * other.error;
        Self::rounded(self.value * other.value, error)
    }

    /// c a, without rounding where c is a power of two
    pub(crate) fn scaled(self, factor: f64, is_exact: bool) -> Self {
        let product = Self {
            value: factor * self.value,
            error: factor.abs() * self.error,
        };
        match is_exact {
            true => product,
            false => Self::rounded(product.value, product.error),
        }
    }

    /// a / b
    pub(crate) fn over(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let error = self.error / b.abs() + (a / b).abs() * other.error / b.abs();
        Self::rounded(a / b, error)
    }

    /// aⁿ by products; n > 0
    pub(crate) fn to_the(self, exponent: u32) -> Self {
        let n = i32::try_from(exponent).unwrap_or(i32::MAX);
        let value = self.value.powi(n);
        let slope = f64::from(exponent) * self.value.powi(n - 1).abs();
        Self {
            value,
            error: slope * self.error + f64::from(exponent - 1) * value.abs(),
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
                return Self {
                    value,
                    error: x.error,
                };
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
        let error = match x.error > 0.0 {
            true => slope.abs() * x.error,
            false => 0.0,
        };
        Self::rounded(value, error + value.abs())
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
        let (x, y) = (Bounded::exact(1e6), Bounded::exact(1e6 + 0.5));
        let difference = x.plus(y.negated());
        assert_eq!(difference.error, 0.5);
        // x² − y² by squares and by the difference
        let squares = x.to_the(2).plus(y.to_the(2).negated());
        let product = difference.times(x.plus(y));
        assert!(squares.error > 1e5 * product.error);
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
