//! Numbers with a bound of their rounding error: a running error analysis, to first order.
//!
//! ```text
//! |computed − exact| ≤ error · 2⁻⁵³ (1 + small)        fl(a + b): error_a + error_b + |a + b|
//! ```
//!
//! Inputs and constants are exact. Each operation adds half an ulp of its result, a function a whole one; an operation
//! whose result is exact for the given numbers, such as the difference of two that are close, adds nothing.
//!
//! A sum counts as exact where it is exact and no larger than the smallest input whose digits it contains, as x − y of
//! close numbers, or x − y − z of three such numbers. Whether a larger one is exact depends on whether it happens to
//! lie below or above a power of two.

use crate::expr::function::Function;

/// A value and the bound of its error, in units of 2⁻⁵³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounded {
    pub(crate) value: f64,
    pub(crate) error: f64,
    /// The error bound of the square root, where it is smaller than what follows from `error`: √(a²) is |a| to the last
    /// digit.
    root_error: Option<f64>,
    /// The unit in the last place that the computed value can have: 2⁻⁵² times the smallest input or rounded number of
    /// which it is an exact sum.
    grid: f64,
}

/// How much larger than the smallest input a sum may be.
const SAME_SIZE: f64 = 1.0 + 1e-5;

/// What the last digit of a number is worth that has as many as it can have, without regard to powers of two.
fn last_place(value: f64) -> f64 {
    value.abs() * f64::EPSILON
}

impl Bounded {
    /// What is not known.
    pub(crate) const NOTHING: Self = Self {
        value: f64::NAN,
        error: 0.0,
        root_error: None,
        grid: f64::NAN,
    };

    /// A number that is given: it has no digits but these.
    pub(crate) fn exact(value: f64) -> Self {
        const EXPONENT: u64 = 0x7ff << 52;
        let digits = value.to_bits() & !(1 << 63) & !EXPONENT;
        let zeros = digits.trailing_zeros().min(52);
        let power = f64::from_bits(value.to_bits() & EXPONENT);
        Self {
            grid: power * f64::EPSILON * 2.0_f64.powi(zeros.cast_signed()),
            ..Self::input(value)
        }
    }

    /// An input: it has all digits that a number of its size can have.
    pub(crate) fn input(value: f64) -> Self {
        Self::new(value, 0.0)
    }

    fn new(value: f64, error: f64) -> Self {
        Self {
            value,
            error,
            root_error: None,
            grid: last_place(value),
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
        let grid = self.grid.min(other.grid);
        let is_one_term = a == 0.0 || b == 0.0 || a == b;
        let is_exact = rest == 0.0 && (is_one_term || last_place(sum) <= SAME_SIZE * grid);
        let mut result = Self::rounded_unless(is_exact, sum, self.error + other.error);
        if is_exact {
            result.grid = match (a == 0.0, b == 0.0) {
                (true, _) => other.grid,
                (_, true) => self.grid,
                _ => grid,
            };
        }
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
        Self {
            value: -self.value,
            root_error: None,
            ..self
        }
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
            true => Self {
                grid: factor.abs() * self.grid,
                ..product
            },
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
        if exponent == 1 {
            return self;
        }
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
        let of = |at: usize| arguments.get(at).copied().unwrap_or(Self::NOTHING);
        let (x, y) = (of(0), of(1));
        let value = function.evaluate(&[x.value, y.value]);
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
                    root_error: None,
                    ..x
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
        let is_exact = match function {
            Function::Sqrt => value.mul_add(value, -v) == 0.0,
            Function::Acos | Function::Acosh | Function::Ln => v == 1.0,
            // cos 0 = 1 and cosh 0 = 1 among them.
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
    fn sums_larger_than_their_terms_are_not_exact_by_chance() {
        // On one side of 1024 and across it.
        for (x, m) in [
            (1_021.489_269, 1022.7),
            (1_021.489_269, 1_023.195_818),
            (700.1, 703.2),
        ] {
            let (x, m) = (Bounded::input(x), Bounded::input(m));
            let twice = m.scaled(2.0, true);
            let other = x.plus(twice.negated());
            assert!(other.value.abs() > x.value);
            assert_eq!(other.error, other.value.abs());
            // (x − m) − m, almost as large as m
            let close = x.plus(m.negated());
            assert_eq!(close.error, 0.0);
            assert_eq!(close.plus(Bounded::exact(-0.5)).error, 0.0);
        }
        let x = 65_536.3;
        let close = Bounded::input(x).plus(Bounded::input(-x * (1.0 + 1e-9)));
        assert_eq!(close.plus(Bounded::input(-x)).error, 0.0, "(x − y) − z");
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
