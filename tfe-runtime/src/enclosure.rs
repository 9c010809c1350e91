//! Interval arithmetic: an enclosure holds all numbers between two bounds, and the value of a kernel for such arguments
//! encloses its values for all numbers between them.

use crate::dual::Differentiable;
use crate::real::{Real, integer_power};
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// An interval: all numbers from `low` to `high`.
///
/// Every operation rounds outwards, so that the result for any numbers within the arguments lies within the result.
/// Where a function is undefined for some of the numbers, the result is that of the others; where it may be undefined
/// for all of them, the result is [`WHOLE`](Self::WHOLE).
///
/// ```
/// use tfe_runtime::Real;
/// use tfe_runtime::enclosure::Enclosure;
///
/// let x = Enclosure::between(1.0, 2.0);
/// let y = x * x - x;
/// assert!(y.low() <= 0.0 && 2.0 <= y.high()); // wider than need be: it is not seen that both x are the same
/// assert_eq!(Real::sin(x).high(), 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure {
    low: f64,
    high: f64,
}

/// The relative amount by which bounds are widened: twice the rounding error of a sum, a product or a quotient, which
/// also covers the rounding of the widening itself.
const ROUNDING: f64 = f64::EPSILON;

/// A bound of the relative error of elementary functions: eight units in the last place, where good libraries promise
/// one to four.
const ELEMENTARY: f64 = 8.0 * f64::EPSILON;

impl Enclosure {
    /// All numbers: nothing is known.
    pub const WHOLE: Self = Self {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    /// Zero exactly.
    pub const ZERO: Self = Self {
        low: 0.0,
        high: 0.0,
    };

    /// All numbers between two given ones; [`WHOLE`](Self::WHOLE) if one of them is NaN.
    #[must_use]
    pub fn between(a: f64, b: f64) -> Self {
        if a <= b {
            Self { low: a, high: b }
        } else if b < a {
            Self { low: b, high: a }
        } else {
            Self::WHOLE
        }
    }

    /// The lower bound.
    #[must_use]
    pub fn low(self) -> f64 {
        self.low
    }

    /// The upper bound.
    #[must_use]
    pub fn high(self) -> f64 {
        self.high
    }

    /// The distance between the bounds; zero where nothing is known.
    pub(crate) fn width(self) -> f64 {
        let width = self.high - self.low;
        if width.is_finite() { width } else { 0.0 }
    }

    /// 1 where all numbers are positive, −1 where all are negative, 0 where neither is certain.
    #[must_use]
    pub fn side(self) -> f64 {
        if self.low > 0.0 {
            1.0
        } else if self.high < 0.0 {
            -1.0
        } else {
            0.0
        }
    }

    /// The smallest enclosure that contains both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn is_zero(self) -> bool {
        self.low == 0.0 && self.high == 0.0
    }

    /// Computed bounds, moved outwards by their possible rounding error.
    #[inline]
    fn widened(low: f64, high: f64, relative: f64) -> Self {
        let (low, high) = (low - relative * low.abs(), high + relative * high.abs());
        // The difference of two infinities is NaN: then nothing is known.
        if low <= high {
            Self { low, high }
        } else {
            Self::WHOLE
        }
    }

    /// The same, also where results below the smallest normal number have lost digits.
    #[inline]
    fn outward(low: f64, high: f64, relative: f64) -> Self {
        Self::widened(low - f64::MIN_POSITIVE, high + f64::MIN_POSITIVE, relative)
    }

    /// The interval from the smallest to the largest of four values.
    #[inline]
    fn of_corners([a, b, c, d]: [f64; 4], relative: f64) -> Self {
        if (a + b + c + d).is_nan() {
            return Self::WHOLE;
        }
        let low = a.min(b).min(c.min(d));
        let high = a.max(b).max(c.max(d));
        Self::outward(low, high, relative)
    }

    /// The image under a monotonically increasing function with this domain.
    fn rising(self, defined: (f64, f64), function: fn(f64) -> f64) -> Self {
        let (low, high) = (self.low.max(defined.0), self.high.min(defined.1));
        if low <= high {
            Self::outward(function(low), function(high), ELEMENTARY)
        } else {
            Self::WHOLE
        }
    }

    /// The first number of the sequence first + k · period that may be within, if there is one.
    fn first_within(self, first: f64, period: f64) -> Option<f64> {
        const MARGIN: f64 = 1e-9;
        let margin = MARGIN * (1.0 + self.low.abs().max(self.high.abs()));
        let next = ((self.low - margin - first) / period).ceil();
        // Also of NaN.
        (!(first + period * next > self.high + margin)).then_some(next)
    }

    /// The image under a function that oscillates between −1 and 1 and has its maxima at `top` + 2πk.
    fn wave(self, top: f64, function: fn(f64) -> f64) -> Self {
        if !(self.high - self.low < TAU) {
            return Self::between(-1.0, 1.0);
        }
        let (a, b) = (function(self.low), function(self.high));
        let ends = Self::widened(a.min(b), a.max(b), ELEMENTARY);
        let (mut low, mut high) = (ends.low.max(-1.0), ends.high.min(1.0));
        if let Some(k) = self.first_within(top, PI) {
            // An extremum; the odd k are minima. An extremum of the other kind may follow it.
            let is_lower = (k as i64) % 2 != 0;
            let other = if is_lower { top } else { top + PI };
            let has_other = self.first_within(other, TAU).is_some();
            if is_lower || has_other {
                low = -1.0;
            }
            if !is_lower || has_other {
                high = 1.0;
            }
        }
        Self { low, high }
    }

    /// Distances from zero.
    fn distances(self) -> Self {
        let (a, b) = (self.low.abs(), self.high.abs());
        let low = if self.side() == 0.0 { 0.0 } else { a.min(b) };
        Self {
            low,
            high: a.max(b),
        }
    }
}

impl Add for Enclosure {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        // Exact values stay exact, such as the zero slopes of constants.
        if other.is_zero() {
            self
        } else if self.is_zero() {
            other
        } else {
            Self::widened(self.low + other.low, self.high + other.high, ROUNDING)
        }
    }
}

impl Sub for Enclosure {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Enclosure {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::ZERO;
        }
        let corners = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        Self::of_corners(corners, ROUNDING)
    }
}

impl Div for Enclosure {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        if other.side() == 0.0 {
            return Self::WHOLE;
        }
        if self.is_zero() {
            return Self::ZERO;
        }
        let corners = [
            self.low / other.low,
            self.low / other.high,
            self.high / other.low,
            self.high / other.high,
        ];
        Self::of_corners(corners, ROUNDING)
    }
}

impl Neg for Enclosure {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self {
            low: -self.high,
            high: -self.low,
        }
    }
}

impl AddAssign for Enclosure {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Enclosure {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Real for Enclosure {
    /// `None` where the comparison holds for some of the numbers only, or may do so.
    type Mask = Option<bool>;

    #[inline]
    fn from_f64(value: f64) -> Self {
        Self::between(value, value)
    }
    fn map(self, _: &mut dyn FnMut(f64) -> f64) -> Self {
        Self::WHOLE
    }
    fn sin_cos(self) -> (Self, Self) {
        (Real::sin(self), Real::cos(self))
    }
    fn sin(self) -> Self {
        self.wave(FRAC_PI_2, <f64 as Real>::sin)
    }
    fn cos(self) -> Self {
        self.wave(0.0, <f64 as Real>::cos)
    }
    fn tan(self) -> Self {
        if !(self.high - self.low < PI) || self.first_within(FRAC_PI_2, PI).is_some() {
            return Self::WHOLE;
        }
        self.rising((f64::NEG_INFINITY, f64::INFINITY), <f64 as Real>::tan)
    }
    fn asin(self) -> Self {
        self.rising((-1.0, 1.0), <f64 as Real>::asin)
    }
    fn acos(self) -> Self {
        (-self).rising((-1.0, 1.0), |x| Real::acos(-x))
    }
    fn atan(self) -> Self {
        self.rising((f64::NEG_INFINITY, f64::INFINITY), <f64 as Real>::atan)
    }
    fn atan2(self, x: Self) -> Self {
        if x.low <= 0.0 && self.side() == 0.0 {
            return Self::outward(-PI, PI, ELEMENTARY);
        }
        let at = |y: f64, x: f64| <f64 as Real>::atan2(y, x);
        let corners = [
            at(self.low, x.low),
            at(self.low, x.high),
            at(self.high, x.low),
            at(self.high, x.high),
        ];
        Self::of_corners(corners, ELEMENTARY)
    }
    fn sinh(self) -> Self {
        self.rising((f64::NEG_INFINITY, f64::INFINITY), <f64 as Real>::sinh)
    }
    fn cosh(self) -> Self {
        self.distances()
            .rising((0.0, f64::INFINITY), <f64 as Real>::cosh)
    }
    fn tanh(self) -> Self {
        self.rising((f64::NEG_INFINITY, f64::INFINITY), <f64 as Real>::tanh)
    }
    fn asinh(self) -> Self {
        self.rising((f64::NEG_INFINITY, f64::INFINITY), <f64 as Real>::asinh)
    }
    fn acosh(self) -> Self {
        self.rising((1.0, f64::INFINITY), <f64 as Real>::acosh)
    }
    fn atanh(self) -> Self {
        self.rising((-1.0, 1.0), <f64 as Real>::atanh)
    }
    fn exp(self) -> Self {
        self.rising((f64::NEG_INFINITY, f64::INFINITY), <f64 as Real>::exp)
    }
    fn ln(self) -> Self {
        if self.high <= 0.0 {
            return Self::WHOLE;
        }
        self.rising((0.0, f64::INFINITY), <f64 as Real>::ln)
    }
    fn sqrt(self) -> Self {
        self.rising((0.0, f64::INFINITY), <f64 as Real>::sqrt)
    }
    fn abs(self) -> Self {
        self.distances()
    }
    fn sign(self) -> Self {
        Self {
            low: Real::sign(self.low),
            high: Real::sign(self.high),
        }
    }
    fn min(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.min(other.high),
        }
    }
    fn max(self, other: Self) -> Self {
        Self {
            low: self.low.max(other.low),
            high: self.high.max(other.high),
        }
    }
    fn hypot(self, other: Self) -> Self {
        let (x, y) = (self.distances(), other.distances());
        let length = <f64 as Real>::hypot;
        Self::outward(length(x.low, y.low), length(x.high, y.high), ELEMENTARY)
    }
    fn powi(self, exponent: i32) -> Self {
        if exponent < 0 {
            // 1/x⁻ⁿ; the one exponent that cannot be negated overflows anyhow.
            return Self::from_f64(1.0) / self.powi(exponent.checked_neg().unwrap_or(i32::MAX - 1));
        }
        if exponent == 0 {
            return Self::from_f64(1.0);
        }
        let x = if exponent % 2 == 0 {
            self.distances()
        } else {
            self
        };
        let power = |x: f64| integer_power(x, exponent);
        let relative = f64::from(exponent) * ROUNDING;
        Self::outward(power(x.low), power(x.high), relative)
    }
    #[allow(clippy::cast_possible_truncation, reason = "compared with what it was")]
    fn powf(self, exponent: Self) -> Self {
        // Beyond 32 bits the conversion would change the number.
        let whole = exponent.low as i32;
        if exponent.low == exponent.high && f64::from(whole) == exponent.low {
            return self.powi(whole);
        }
        let base = Self {
            low: self.low.max(0.0),
            high: self.high,
        };
        // With integer exponents, negative bases have powers as well.
        if !(base.low <= base.high) || (self.low < 0.0 && exponent.low < exponent.high) {
            return Self::WHOLE;
        }
        let power = |b: f64, e: f64| <f64 as Real>::powf(b, e);
        let corners = [
            power(base.low, exponent.low),
            power(base.low, exponent.high),
            power(base.high, exponent.low),
            power(base.high, exponent.high),
        ];
        Self::of_corners(corners, ELEMENTARY)
    }
    fn less(self, other: Self) -> Option<bool> {
        if self.high < other.low {
            Some(true)
        } else if self.low >= other.high {
            Some(false)
        } else {
            None
        }
    }
    fn less_or_equal(self, other: Self) -> Option<bool> {
        other.less(self).map(|less| !less)
    }
    fn select(mask: Option<bool>, then: Self, otherwise: Self) -> Self {
        match mask {
            Some(true) => then,
            Some(false) => otherwise,
            None => then.hull(otherwise),
        }
    }
}

impl Differentiable for Enclosure {
    /// Where both branches may be taken there may be a jump between them.
    fn slope_of_choice(mask: Option<bool>, then: Self, otherwise: Self) -> Self {
        match mask {
            None => Self::WHOLE,
            _ => Self::select(mask, then, otherwise),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;

    type Function<R> = fn(R, R) -> R;

    /// Every function, of enclosures, of numbers, and of both with slopes.
    macro_rules! functions {
        ($($name:literal, $x:ident, $y:ident, $value:expr;)*) => {
            [$((
                $name,
                (|$x, $y| $value) as Function<Dual<Enclosure>>,
                (|$x, $y| $value) as Function<Dual>,
            )),*]
        };
    }

    /// Numbers between the bounds have values between the bounds of values, and slopes between those of slopes: wide
    /// and narrow enclosures, also beyond where functions are defined.
    #[test]
    fn values_and_slopes_are_within_their_bounds() {
        let functions = functions! {
            "+", x, y, x + y;
            "-", x, y, x - y;
            "*", x, y, x * y;
            "/", x, y, x / y;
            "sin", x, _y, Real::sin(x);
            "cos", x, _y, Real::cos(x);
            "tan", x, _y, Real::tan(x);
            "asin", x, _y, Real::asin(x);
            "acos", x, _y, Real::acos(x);
            "atan", x, _y, Real::atan(x);
            "atan2", x, y, Real::atan2(x, y);
            "sinh", x, _y, Real::sinh(x);
            "cosh", x, _y, Real::cosh(x);
            "tanh", x, _y, Real::tanh(x);
            "asinh", x, _y, Real::asinh(x);
            "acosh", x, _y, Real::acosh(x);
            "atanh", x, _y, Real::atanh(x);
            "exp", x, _y, Real::exp(x);
            "ln", x, _y, Real::ln(x);
            "sqrt", x, _y, Real::sqrt(x);
            "abs", x, _y, Real::abs(x);
            "min", x, y, Real::min(x, y);
            "max", x, y, Real::max(x, y);
            "hypot", x, y, Real::hypot(x, y);
            "square", x, _y, Real::powi(x, 2);
            "cube", x, _y, Real::powi(x, 3);
            "inverse", x, _y, Real::powi(x, -1);
            "fourth", x, _y, Real::powi(x, -4);
            "power", x, y, Real::powf(x, y);
            "choice", x, y, Real::select(Real::less(x, y), x * x, y + x);
        };
        let mut seed = 11_u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let (mut checked, mut known) = (0, 0);
        for round in 0..400 {
            let scale = [1.0, 5.0, 100.0, 1e-3][round % 4];
            let width = [1.0, 1e-3, 1e-9, 0.1, 0.0][round % 5];
            let (a, b) = (scale * random(), scale * random());
            let (da, db) = (width * random(), width * random());
            let (sa, sb) = (random(), random());
            for (name, bounds, exact) in &functions {
                let over = |from: f64, more: f64, slope: f64| {
                    let slope = Enclosure::between(slope, slope + more);
                    Dual::new(Enclosure::between(from, from + more), slope)
                };
                let found = bounds(over(a, da, sa), over(b, db, sb));
                known += u32::from(found.value.high - found.value.low < 1e3);
                for k in 0..20 {
                    let part = |k: u32| f64::from(k) / 19.0;
                    let (s, r) = (part(k), part((k * 7) % 20));
                    let x = Dual::new(a + s * da, sa + r * da);
                    let y = Dual::new(b + r * db, sb + s * db);
                    let value = exact(x, y);
                    if value.value.is_nan() || value.slope.is_nan() {
                        continue;
                    }
                    checked += 1;
                    for (bounds, value) in [(found.value, value.value), (found.slope, value.slope)]
                    {
                        // What the slope itself is rounded by.
                        let off = 1e-12 * value.abs().max(1e-12);
                        assert!(
                            bounds.low - off <= value && value <= bounds.high + off,
                            "{name}: {value:e} beyond {bounds:?} at {x:?}, {y:?}"
                        );
                    }
                }
            }
        }
        assert!(checked > 200_000 && known > 8000, "{checked} {known}");
    }

    /// A wave knows where it is highest, and what jumps has no bounded slope.
    #[test]
    fn bounds_are_close() {
        let near = |x: Enclosure, low: f64, high: f64| {
            assert!(
                (x.low - low).abs() < 1e-14 && (x.high - high).abs() < 1e-14,
                "{x:?}"
            );
        };
        near(Real::sin(Enclosure::between(1.0, 2.0)), 1.0_f64.sin(), 1.0);
        near(
            Real::cos(Enclosure::between(1.0, 2.0)),
            2.0_f64.cos(),
            1.0_f64.cos(),
        );
        near(Real::sin(Enclosure::between(101.0, 120.0)), -1.0, 1.0);
        near(Real::powi(Enclosure::between(-2.0, 1.0), 2), 0.0, 4.0);
        near(Real::sqrt(Enclosure::between(-1.0, 4.0)), 0.0, 2.0);
        let slope = |x: Enclosure, f: fn(Dual<Enclosure>) -> Dual<Enclosure>| {
            f(Dual::new(x, Enclosure::from_f64(1.0))).slope
        };
        let around = Enclosure::between(-1.0, 2.0);
        assert_eq!(slope(around, Real::sign), Enclosure::WHOLE);
        near(slope(around, Real::abs), -1.0, 1.0);
        assert_eq!(
            slope(Enclosure::between(1.0, 2.0), Real::sign),
            Enclosure::ZERO
        );
        assert_eq!(Real::ln(Enclosure::between(-2.0, -1.0)), Enclosure::WHOLE);
        assert_eq!(Enclosure::between(f64::NAN, 1.0), Enclosure::WHOLE);
    }
}
