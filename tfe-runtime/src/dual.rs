//! Dual numbers: one kernel call gives the values and their derivatives along one direction.
//!
//! Constraints and forces may depend on the time and on parameters in any way. Their derivatives by these are computed
//! with dual numbers, so that no kernels need to be generated for them.

use crate::real::Real;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// x + ε x′ with ε² = 0.
///
/// A kernel called with dual numbers for t, q and z differentiates along the slopes of its arguments. The time may in
/// addition carry the index of a [parameter](Self::by_parameter): kernels make their parameters from the time argument,
/// and this one gets the slope 1.
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
pub struct Dual<S = f64> {
    /// x
    pub value: S,
    /// x′
    pub slope: S,
    /// The index of the parameter with slope 1; carried by the time argument of a kernel.
    parameter: Option<usize>,
}

/// Scalars over which [dual numbers](Dual) can be formed.
pub trait Differentiable: Real {
    /// The slope of the result of `select`, from the slopes of both branches.
    #[must_use]
    fn slope_of_choice(mask: Self::Mask, then: Self, otherwise: Self) -> Self {
        Self::select(mask, then, otherwise)
    }

    /// f′ x′ for a slope x′ (`self`); zero where the slope is zero, even if f′ is infinite (as of √ at 0): along such a
    /// direction nothing changes.
    #[must_use]
    fn times_derivative(self, derivative: Self) -> Self {
        unless_zero(self, derivative * self)
    }

    /// x′/r for a slope x′ (`self`) that vanishes where r does; zero where the slope is zero.
    #[must_use]
    fn over_length(self, length: Self) -> Self {
        unless_zero(self, self / length)
    }
}

impl Differentiable for f64 {}

/// Dual numbers over dual numbers give second derivatives: with slopes along x and along y, the slope of the slope is
/// ∂²/∂x∂y.
///
/// ```
/// use tfe_runtime::Real;
/// use tfe_runtime::dual::Dual;
///
/// // ∂²(x² sin y)/∂x∂y = 2 x cos y
/// let x = Dual::new(Dual::new(3.0, 1.0), Dual::new(0.0, 0.0));
/// let y = Dual::new(Dual::new(0.5, 0.0), Dual::new(1.0, 0.0));
/// let second = (x * x * y.sin()).slope.slope;
/// assert!((second - 6.0 * 0.5_f64.cos()).abs() < 1e-15);
/// ```
impl<S: Differentiable> Differentiable for Dual<S> {
    fn slope_of_choice(mask: Self::Mask, then: Self, otherwise: Self) -> Self {
        Self::new(
            S::slope_of_choice(mask, then.value, otherwise.value),
            S::slope_of_choice(mask, then.slope, otherwise.slope),
        )
    }

    /// By the product rule, the slope of f′ x′ is (f′)′ x′ + f′ (x′)′; the second term counts also where x′ is zero, as
    /// for x y at x = 0.
    fn times_derivative(self, derivative: Self) -> Self {
        let of_derivative = self.value.times_derivative(derivative.slope);
        let of_slope = self.slope.times_derivative(derivative.value);
        // Here, too, an infinite derivative counts as zero along a direction in which nothing changes.
        let is_finite = (derivative.value.abs()).less_or_equal(number(f64::MAX));
        Self::new(
            self.value.times_derivative(derivative.value),
            of_derivative + S::select(is_finite, of_slope, number(0.0)),
        )
    }

    fn over_length(self, length: Self) -> Self {
        let value = self.value.over_length(length.value);
        let slope = (self.slope - value * length.slope) / length.value;
        Self::new(value, unless_zero(length.value, slope))
    }
}

impl Dual {
    /// 0 + ε 0
    pub const ZERO: Self = Self::new(0.0, 0.0);
}

impl<S: Copy> Dual<S> {
    /// value + ε slope
    #[must_use]
    pub const fn new(value: S, slope: S) -> Self {
        Self {
            value,
            slope,
            parameter: None,
        }
    }

    /// A time argument with which kernels also differentiate by the parameter of this index,
    /// [`Model::parameter_name`](crate::Model::parameter_name).
    #[must_use]
    pub const fn by_parameter(self, parameter: Option<usize>) -> Self {
        Self { parameter, ..self }
    }
}

impl<S: Differentiable> Dual<S> {
    /// f(x) and f′(x) x′.
    fn chain(self, value: S, derivative: S) -> Self {
        Self::new(value, self.slope.times_derivative(derivative))
    }
}

/// `otherwise`, or zero where `other` is zero.
fn unless_zero<S: Real>(other: S, otherwise: S) -> S {
    let zero = S::from_f64(0.0);
    S::select(other.abs().less_or_equal(zero), zero, otherwise)
}

/// (1 − x)(1 + x), without loss of digits near ±1.
pub(crate) fn below_one<S: Real>(x: S) -> S {
    let one = number::<S>(1.0);
    (one - x) * (one + x)
}

/// A constant: a number with slope zero.
fn number<S: Real>(value: f64) -> S {
    S::from_f64(value)
}

/// A vector of dual numbers with given slopes.
#[must_use]
pub fn duals<const N: usize>(values: &[f64; N], slopes: &[f64; N]) -> [Dual; N] {
    let mut duals = [Dual::ZERO; N];
    for a in 0..N {
        duals[a] = Dual::new(values[a], slopes[a]);
    }
    duals
}

impl<S: Differentiable> Add for Dual<S> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value, self.slope + other.slope)
    }
}

impl<S: Differentiable> Sub for Dual<S> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.value - other.value, self.slope - other.slope)
    }
}

impl<S: Differentiable> Mul for Dual<S> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let slope = self.slope * other.value + self.value * other.slope;
        Self::new(self.value * other.value, slope)
    }
}

impl<S: Differentiable> Div for Dual<S> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self::new(value, (self.slope - value * other.slope) / other.value)
    }
}

impl<S: Differentiable> Neg for Dual<S> {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.value, -self.slope)
    }
}

impl<S: Differentiable> AddAssign for Dual<S> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Differentiable> SubAssign for Dual<S> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<S: Differentiable> Real for Dual<S> {
    type Mask = S::Mask;

    fn from_f64(value: f64) -> Self {
        Self::new(number(value), number(0.0))
    }
    fn parameter(self, index: usize, value: f64) -> Self {
        let is_it = self.parameter == Some(index);
        Self::new(number(value), number(f64::from(u8::from(is_it))))
    }
    /// The slope is a central difference whose truncation error and rounding error are balanced: accurate to about
    /// 1e-10 of the change of the function over a unit of its argument.
    fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
        const DISTANCE: f64 = 6e-6;
        let value = self.value.map(function);
        let distance =
            (self.value).map(&mut |x| DISTANCE * Real::powf(x.abs().max(1.0), 1.0 / 3.0));
        let (before, after) = (self.value - distance, self.value + distance);
        let rate = (after.map(function) - before.map(function)) / (after - before);
        self.chain(value, rate)
    }
    fn map_with_derivatives(self, derivatives: &mut dyn FnMut(u32, f64) -> f64) -> Self {
        let value = self.value.map_with_derivatives(derivatives);
        let rate = self
            .value
            .map_with_derivatives(&mut |order, x| derivatives(order + 1, x));
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
        self.chain(tan, number::<S>(1.0) + tan * tan)
    }
    fn asin(self) -> Self {
        let x = self.value;
        self.chain(Real::asin(x), number::<S>(1.0) / below_one(x).sqrt())
    }
    fn acos(self) -> Self {
        let x = self.value;
        self.chain(Real::acos(x), -(number::<S>(1.0)) / below_one(x).sqrt())
    }
    fn atan(self) -> Self {
        let x = self.value;
        self.chain(Real::atan(x), number::<S>(1.0) / (number::<S>(1.0) + x * x))
    }
    fn atan2(self, x: Self) -> Self {
        let square = x.value * x.value + self.value * self.value;
        let slope = (x.value * self.slope - self.value * x.slope) / square;
        // To the left of the origin the function jumps.
        let zero = number(0.0);
        let across = S::slope_of_choice(self.value.less(zero), slope, slope);
        let slope = S::slope_of_choice(x.value.less(zero), across, slope);
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
        self.chain(tanh, number::<S>(1.0) - tanh * tanh)
    }
    fn asinh(self) -> Self {
        let x = self.value;
        self.chain(
            Real::asinh(x),
            number::<S>(1.0) / (x * x + number(1.0)).sqrt(),
        )
    }
    fn acosh(self) -> Self {
        let (x, one) = (self.value, number::<S>(1.0));
        self.chain(Real::acosh(x), one / ((x - one) * (x + one)).sqrt())
    }
    fn atanh(self) -> Self {
        let x = self.value;
        self.chain(Real::atanh(x), number::<S>(1.0) / below_one(x))
    }
    fn exp(self) -> Self {
        let exp = Real::exp(self.value);
        self.chain(exp, exp)
    }
    fn ln(self) -> Self {
        self.chain(Real::ln(self.value), number::<S>(1.0) / self.value)
    }
    fn sqrt(self) -> Self {
        let root = Real::sqrt(self.value);
        self.chain(root, number::<S>(0.5) / root)
    }
    fn abs(self) -> Self {
        self.chain(self.value.abs(), Real::sign(self.value))
    }
    fn sign(self) -> Self {
        let zero = number(0.0);
        let slope = S::slope_of_choice(self.value.less(zero), zero, zero);
        Self::new(self.value.sign(), slope)
    }
    fn min(self, other: Self) -> Self {
        let is_less = other.value.less(self.value);
        let slope = S::select(is_less, other.slope, self.slope);
        Self::new(self.value.min(other.value), slope)
    }
    fn max(self, other: Self) -> Self {
        let is_larger = self.value.less(other.value);
        let slope = S::select(is_larger, other.slope, self.slope);
        Self::new(self.value.max(other.value), slope)
    }
    fn hypot(self, other: Self) -> Self {
        let root = Real::hypot(self.value, other.value);
        let slope = self.value * self.slope + other.value * other.slope;
        Self::new(root, slope.over_length(root))
    }
    fn powi(self, exponent: i32) -> Self {
        let derivative = if exponent == 0 {
            number(0.0)
        } else {
            number::<S>(f64::from(exponent)) * Real::powi(self.value, exponent.saturating_sub(1))
        };
        self.chain(Real::powi(self.value, exponent), derivative)
    }
    fn powf(self, exponent: Self) -> Self {
        let value = Real::powf(self.value, exponent.value);
        let by_base = exponent.value * Real::powf(self.value, exponent.value - number(1.0));
        // x⁰ is constant: at zero its slope would be zero times infinity.
        let by_base = unless_zero(self.value.abs() + exponent.value.abs(), by_base);
        let mut result = self.chain(value, by_base);
        // Where the power vanishes, the logarithm is infinite and the slope zero.
        let by_exponent = unless_zero(value, value * Real::ln(self.value));
        result.slope += exponent.slope.times_derivative(by_exponent);
        result
    }
    fn less(self, other: Self) -> S::Mask {
        self.value.less(other.value)
    }
    fn less_or_equal(self, other: Self) -> S::Mask {
        self.value.less_or_equal(other.value)
    }
    fn select(mask: S::Mask, then: Self, otherwise: Self) -> Self {
        Self::new(
            S::select(mask, then.value, otherwise.value),
            S::slope_of_choice(mask, then.slope, otherwise.slope),
        )
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

    type Twice = Dual<Dual>;

    /// ∂²f/∂x∂y at x = 0, y = 1/2: where x y stands inside another function its slope along y is zero, and the slope of
    /// that is not.
    #[test]
    fn second_derivatives_see_the_bend_of_what_has_no_slope() {
        let one = |value: f64| Twice::from_f64(value);
        let x = Dual::new(Dual::new(0.0, 1.0), Dual::ZERO);
        let y = Dual::new(Dual::new(0.5, 0.0), Dual::new(1.0, 0.0));
        let product = x * y;
        for (name, value, exact) in [
            ("sin", Real::sin(product), 1.0),
            ("exp", Real::exp(product), 1.0),
            ("atan", Real::atan(product), 1.0),
            ("sqrt", Real::sqrt(one(1.0) + product), 0.5),
            ("powf", Real::powf(one(1.0) + product, one(1.5)), 1.5),
            (
                "power",
                Real::powf(one(2.0), product),
                core::f64::consts::LN_2,
            ),
            (
                "hypot",
                Real::hypot(one(1.0) + product, one(1.0)),
                core::f64::consts::FRAC_1_SQRT_2,
            ),
        ] {
            let found = value.slope.slope;
            assert!(
                (found - exact).abs() < 4.0 * f64::EPSILON,
                "{name}: {found}"
            );
        }
    }

    #[test]
    fn a_power_with_exponent_zero_has_no_slope() {
        for x in [0.0, 2.0] {
            let power = Real::powf(Dual::new(x, 1.0), Dual::from_f64(0.0));
            assert_eq!((power.value, power.slope), (1.0, 0.0));
        }
    }

    /// An infinite derivative is none along what has no slope, to second order as well: |v| v at rest.
    #[test]
    fn roots_at_zero_have_no_second_derivatives() {
        let v = Dual::new(Dual::new(0.0, 1.0), Dual::new(1.0, 0.0));
        let still = Twice::from_f64(0.0);
        for drag in [Real::sqrt(v * v) * v, Real::hypot(v, still) * v] {
            assert_eq!((drag.slope.value, drag.slope.slope), (0.0, 0.0));
        }
    }

    /// 1/√((1 − x)(1 + x)) and 1/((1 − x)(1 + x)) beside one, of the rounded x in 40 digits: by x² the last five would
    /// be lost.
    #[test]
    fn slopes_beside_one_have_all_digits() {
        let (below, above) = (Dual::new(1.0 - 1e-10, 1.0), Dual::new(1.0 + 1e-10, 1.0));
        for (name, value, exact) in [
            ("asin", Real::asin(below), 70_710.675_195_108_83),
            ("acos", Real::acos(below), -70_710.675_195_108_83),
            ("atanh", Real::atanh(below), 4_999_999_586.548_179),
            ("acosh", Real::acosh(above), 70_710.675_191_573_3),
        ] {
            // A subtraction, a sum, a product, a root and a quotient.
            let off = (value.slope - exact).abs() / exact.abs();
            assert!(off < 4.0 * f64::EPSILON, "{name}: {off:e}");
        }
    }
}
