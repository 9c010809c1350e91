//! Numbers with a derivative: one kernel call gives the values and their derivative along one direction.
//!
//! Constraints and forces may depend on the time and on parameters in any way; what a moving instant or another parameter changes comes from here, so that generated
//! code needs no kernels for it.

use crate::real::Real;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// x + ε x′ with ε² = 0.
///
/// Kernels given such numbers for t, q and z differentiate along the slopes of their arguments. The time may carry a [parameter](Self::by_parameter) besides: kernels
/// make their parameters of it, and that one of slope 1.
///
/// ```
/// use tfe_runtime::Real;
/// use tfe_runtime::dual::Dual;
///
/// // d(x sin x)/dx at x = 2
/// let x = Dual::new(2.0, 1.0);
/// let slope = (x * x.sin()).slope;
/// assert!((slope - (2.0_f64.sin() + 2.0 * 2.0_f64.cos())).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    /// x
    pub value: f64,
    /// x′
    pub slope: f64,
    /// The parameter of slope 1, on the time that a kernel is given.
    parameter: Option<usize>,
}

impl Dual {
    /// 0 + ε 0
    pub const ZERO: Self = Self::new(0.0, 0.0);

    /// value + ε slope
    #[must_use]
    pub const fn new(value: f64, slope: f64) -> Self {
        Self {
            value,
            slope,
            parameter: None,
        }
    }

    /// A time with which kernels differentiate by the parameter of this index, [`Model::parameter_name`](crate::Model::parameter_name), besides.
    #[must_use]
    pub const fn by_parameter(self, parameter: Option<usize>) -> Self {
        Self { parameter, ..self }
    }

    /// f(x) and f′(x) x′.
    fn chain(self, value: f64, derivative: f64) -> Self {
        // At x′ = 0 an infinite derivative (√0) is no derivative along this direction.
        let slope = if self.slope == 0.0 {
            0.0
        } else {
            derivative * self.slope
        };
        Self::new(value, slope)
    }
}

/// A vector whose slopes are given.
#[must_use]
pub fn duals<const N: usize>(values: &[f64; N], slopes: &[f64; N]) -> [Dual; N] {
    let mut duals = [Dual::ZERO; N];
    for a in 0..N {
        duals[a] = Dual::new(values[a], slopes[a]);
    }
    duals
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value, self.slope + other.slope)
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.value - other.value, self.slope - other.slope)
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let slope = self.slope * other.value + self.value * other.slope;
        Self::new(self.value * other.value, slope)
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self::new(value, (self.slope - value * other.slope) / other.value)
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.value, -self.slope)
    }
}

impl AddAssign for Dual {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Dual {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Real for Dual {
    type Mask = bool;

    fn from_f64(value: f64) -> Self {
        Self::new(value, 0.0)
    }
    fn parameter(self, index: usize, value: f64) -> Self {
        let is_it = self.parameter == Some(index);
        Self::new(value, f64::from(u8::from(is_it)))
    }
    /// The slope is that of a difference over a distance at which its two errors, of second order and of rounding, are alike: good to some 1e-10 of what the function
    /// does in a unit of its argument.
    fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
        const DISTANCE: f64 = 6e-6;
        let value = function(self.value);
        if self.slope == 0.0 {
            return Self::new(value, 0.0);
        }
        let distance = DISTANCE * Real::max(self.value.abs(), 1.0);
        let (before, after) = (self.value - distance, self.value + distance);
        let rate = (function(after) - function(before)) / (after - before);
        self.chain(value, rate)
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Real::sin_cos(self.value);
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    fn tan(self) -> Self {
        let tan = Real::tan(self.value);
        self.chain(tan, 1.0 + tan * tan)
    }
    fn asin(self) -> Self {
        let x = self.value;
        self.chain(Real::asin(x), 1.0 / Real::sqrt(1.0 - x * x))
    }
    fn acos(self) -> Self {
        let x = self.value;
        self.chain(Real::acos(x), -1.0 / Real::sqrt(1.0 - x * x))
    }
    fn atan(self) -> Self {
        let x = self.value;
        self.chain(Real::atan(x), 1.0 / (1.0 + x * x))
    }
    fn atan2(self, x: Self) -> Self {
        let square = x.value * x.value + self.value * self.value;
        let slope = (x.value * self.slope - self.value * x.slope) / square;
        Self::new(Real::atan2(self.value, x.value), slope)
    }
    fn sinh(self) -> Self {
        self.chain(Real::sinh(self.value), Real::cosh(self.value))
    }
    fn cosh(self) -> Self {
        self.chain(Real::cosh(self.value), Real::sinh(self.value))
    }
    fn tanh(self) -> Self {
        let tanh = Real::tanh(self.value);
        self.chain(tanh, 1.0 - tanh * tanh)
    }
    fn asinh(self) -> Self {
        let x = self.value;
        self.chain(Real::asinh(x), 1.0 / Real::sqrt(x * x + 1.0))
    }
    fn acosh(self) -> Self {
        let x = self.value;
        self.chain(Real::acosh(x), 1.0 / Real::sqrt(x * x - 1.0))
    }
    fn atanh(self) -> Self {
        let x = self.value;
        self.chain(Real::atanh(x), 1.0 / (1.0 - x * x))
    }
    fn exp(self) -> Self {
        let exp = Real::exp(self.value);
        self.chain(exp, exp)
    }
    fn ln(self) -> Self {
        self.chain(Real::ln(self.value), 1.0 / self.value)
    }
    fn sqrt(self) -> Self {
        let root = Real::sqrt(self.value);
        self.chain(root, 0.5 / root)
    }
    fn abs(self) -> Self {
        self.chain(self.value.abs(), Real::sign(self.value))
    }
    fn sign(self) -> Self {
        self.chain(Real::sign(self.value), 0.0)
    }
    fn min(self, other: Self) -> Self {
        if other.value < self.value || other.value.is_nan() {
            other
        } else {
            self
        }
    }
    fn max(self, other: Self) -> Self {
        if other.value > self.value || other.value.is_nan() {
            other
        } else {
            self
        }
    }
    fn hypot(self, other: Self) -> Self {
        let root = Real::hypot(self.value, other.value);
        let slope = self.value * self.slope + other.value * other.slope;
        Self::new(root, if slope == 0.0 { 0.0 } else { slope / root })
    }
    fn powi(self, exponent: i32) -> Self {
        let derivative = if exponent == 0 {
            0.0
        } else {
            f64::from(exponent) * Real::powi(self.value, exponent.saturating_sub(1))
        };
        self.chain(Real::powi(self.value, exponent), derivative)
    }
    fn powf(self, exponent: Self) -> Self {
        let value = Real::powf(self.value, exponent.value);
        let by_base = exponent.value * Real::powf(self.value, exponent.value - 1.0);
        let mut result = self.chain(value, by_base);
        if exponent.slope != 0.0 {
            result.slope += value * Real::ln(self.value) * exponent.slope;
        }
        result
    }
    fn less(self, other: Self) -> bool {
        self.value < other.value
    }
    fn less_or_equal(self, other: Self) -> bool {
        self.value <= other.value
    }
    fn select(mask: bool, then: Self, otherwise: Self) -> Self {
        if mask { then } else { otherwise }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every function against a central difference.
    #[test]
    fn slopes_are_derivatives() {
        type Function = fn(Dual) -> Dual;
        let functions: [(&str, Function); 20] = [
            ("sin", Real::sin),
            ("cos", Real::cos),
            ("tan", Real::tan),
            ("asin", Real::asin),
            ("acos", Real::acos),
            ("atan", Real::atan),
            ("sinh", Real::sinh),
            ("cosh", Real::cosh),
            ("tanh", Real::tanh),
            ("asinh", Real::asinh),
            ("acosh", |x| Real::acosh(x + Dual::from_f64(1.0))),
            ("atanh", Real::atanh),
            ("exp", Real::exp),
            ("ln", Real::ln),
            ("sqrt", Real::sqrt),
            ("hypot", |x| Real::hypot(x, x * x)),
            ("atan2", |x| Real::atan2(x, x * x + Dual::from_f64(1.0))),
            ("powi", |x| Real::powi(x, -3)),
            ("powf", |x| Real::powf(x, x)),
            ("div", |x| Dual::from_f64(1.0) / (x - Dual::from_f64(3.0))),
        ];
        for (name, function) in functions {
            let (x, step) = (0.37, 1e-5);
            let exact = function(Dual::new(x, 1.0)).slope;
            let value = |x| function(Dual::new(x, 0.0)).value;
            let difference = (value(x + step) - value(x - step)) / (2.0 * step);
            // Truncation 1e-10 times third derivatives below 1e3.
            assert!(
                (exact - difference).abs() < 1e-7 * exact.abs().max(1.0),
                "{name}"
            );
        }
    }
}
