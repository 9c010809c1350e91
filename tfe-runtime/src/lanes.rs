//! The scalars of kernels: single numbers, and several numbers side by side.

use crate::real::{Real, integer_power};
use crate::trigonometry;
use crate::{arctangent, exponential};
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// W numbers side by side: one kernel evaluates W instants, or W trajectories, at once.
///
/// The loops over lanes are plain, so that the compiler turns them into vector instructions. The elementary functions
/// listed below are written in the same way and give the same digits on every processor; all others are those of the
/// system, called for one lane after the other. Their errors, measured against double-double arithmetic in units in the
/// last place, are less than
///
/// | `exp`, `ln` | `powf` | `sin`, `cos`, `atan`, `atan2` | `sin_cos` | `tanh` |
/// |---|---|---|---|---|
/// | 1 | 1.2 | 1.5 | 2 | 3 |
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes<const W: usize>(pub [f64; W]);

macro_rules! lane_operators {
    ($($operator:ident $method:ident $symbol:tt;)*) => {$(
        impl<const W: usize> $operator for Lanes<W> {
            type Output = Self;
            #[inline]
            fn $method(self, other: Self) -> Self {
                let mut result = self.0;
                for lane in 0..W {
                    result[lane] = self.0[lane] $symbol other.0[lane];
                }
                Self(result)
            }
        }
    )*};
}
lane_operators! { Add add +; Sub sub -; Mul mul *; Div div /; }

impl<const W: usize> Neg for Lanes<W> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        let mut result = self.0;
        for lane in 0..W {
            result[lane] = -self.0[lane];
        }
        Self(result)
    }
}

impl<const W: usize> AddAssign for Lanes<W> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const W: usize> SubAssign for Lanes<W> {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// The elementary functions of `f64` and `f32`: from `std`, or from `libm` without it.
macro_rules! elementary {
    (
        in lanes { $($own:ident($($other:ident),*) = $own_std:ident, $own_libm:ident, $own_libm32:ident of $module:ident;)* }
        lane by lane { $($name:ident($($argument:ident),*) = $std:ident, $libm:ident, $libm32:ident;)* }
    ) => {
        impl Real for f64 {
            scalar_items!(f64);
            $(#[inline]
            fn $own(self $(, $other: Self)*) -> Self {
                #[cfg(feature = "std")]
                { f64::$own_std(self $(, $other)*) }
                #[cfg(not(feature = "std"))]
                { libm::$own_libm(self $(, $other)*) }
            })*
            $(#[inline]
            fn $name(self $(, $argument: Self)*) -> Self {
                #[cfg(feature = "std")]
                { f64::$std(self $(, $argument)*) }
                #[cfg(not(feature = "std"))]
                { libm::$libm(self $(, $argument)*) }
            })*
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                #[cfg(feature = "std")]
                { f64::sin_cos(self) }
                #[cfg(not(feature = "std"))]
                { libm::sincos(self) }
            }
            scalar_sines!(f64, libm::sin, libm::cos);
        }
        impl Real for f32 {
            scalar_items!(f32);
            $(#[inline]
            fn $own(self $(, $other: Self)*) -> Self {
                #[cfg(feature = "std")]
                { f32::$own_std(self $(, $other)*) }
                #[cfg(not(feature = "std"))]
                { libm::$own_libm32(self $(, $other)*) }
            })*
            $(#[inline]
            fn $name(self $(, $argument: Self)*) -> Self {
                #[cfg(feature = "std")]
                { f32::$std(self $(, $argument)*) }
                #[cfg(not(feature = "std"))]
                { libm::$libm32(self $(, $argument)*) }
            })*
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                #[cfg(feature = "std")]
                { f32::sin_cos(self) }
                #[cfg(not(feature = "std"))]
                { libm::sincosf(self) }
            }
            scalar_sines!(f32, libm::sinf, libm::cosf);
        }
        impl<const W: usize> Real for Lanes<W> {
            lane_items!();
            #[inline]
            fn sin(self) -> Self {
                Self(trigonometry::sin(&self.0))
            }
            #[inline]
            fn cos(self) -> Self {
                Self(trigonometry::cos(&self.0))
            }
            $(#[inline]
            fn $own(self $(, $other: Self)*) -> Self {
                Self($module::$own(&self.0 $(, &$other.0)*))
            })*
            $(lane_function!($name $($argument)*);)*
        }
    };
}

/// A sine or a cosine alone, at half the cost of both.
macro_rules! scalar_sines {
    ($scalar:ident, $sin:path, $cos:path) => {
        #[inline]
        fn sin(self) -> Self {
            #[cfg(feature = "std")]
            {
                $scalar::sin(self)
            }
            #[cfg(not(feature = "std"))]
            {
                $sin(self)
            }
        }
        #[inline]
        fn cos(self) -> Self {
            #[cfg(feature = "std")]
            {
                $scalar::cos(self)
            }
            #[cfg(not(feature = "std"))]
            {
                $cos(self)
            }
        }
    };
}

/// An elementary function of the system, called for one lane after the other.
macro_rules! lane_function {
    ($name:ident $($argument:ident)*) => {
        #[inline]
        fn $name(self $(, $argument: Self)*) -> Self {
            let mut result = self.0;
            for lane in 0..W {
                result[lane] = <f64 as Real>::$name(self.0[lane] $(, $argument.0[lane])*);
            }
            Self(result)
        }
    };
}

/// The operations that need no library: the same text for `f64` and `f32`.
macro_rules! scalar_items {
    ($scalar:ident) => {
        type Mask = bool;
        #[inline]
        #[allow(
            clippy::cast_possible_truncation,
            reason = "f32 rounds to its nearest number"
        )]
        fn from_f64(value: f64) -> Self {
            value as $scalar
        }
        #[inline]
        #[allow(
            clippy::cast_lossless,
            clippy::cast_possible_truncation,
            reason = "f32 rounds to its nearest number"
        )]
        fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
            function(self as f64) as $scalar
        }
        #[inline]
        fn abs(self) -> Self {
            $scalar::abs(self)
        }
        #[inline]
        fn sign(self) -> Self {
            if self > 0.0 {
                1.0
            } else if self < 0.0 {
                -1.0
            } else {
                // Zero gives zero, and a NaN stays one.
                self
            }
        }
        #[inline]
        fn min(self, other: Self) -> Self {
            // A comparison instead of `f64::min`, so that a NaN is not lost.
            if other < self || other.is_nan() {
                other
            } else {
                self
            }
        }
        #[inline]
        fn max(self, other: Self) -> Self {
            if other > self || other.is_nan() {
                other
            } else {
                self
            }
        }
        #[inline]
        fn powi(self, exponent: i32) -> Self {
            integer_power(self, exponent)
        }
        #[inline]
        fn less(self, other: Self) -> bool {
            self < other
        }
        #[inline]
        fn less_or_equal(self, other: Self) -> bool {
            self <= other
        }
        #[inline]
        fn select(mask: bool, then: Self, otherwise: Self) -> Self {
            if mask { then } else { otherwise }
        }
    };
}

/// The operations of lanes other than elementary functions.
macro_rules! lane_items {
    () => {
        type Mask = [bool; W];
        #[inline]
        fn from_f64(value: f64) -> Self {
            Self([value; W])
        }
        #[inline]
        fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
            Self(self.0.map(function))
        }
        #[inline]
        fn sin_cos(self) -> (Self, Self) {
            let (sin, cos) = trigonometry::sin_cos(&self.0);
            (Self(sin), Self(cos))
        }
        #[inline]
        fn abs(self) -> Self {
            let mut result = self.0;
            for lane in 0..W {
                result[lane] = self.0[lane].abs();
            }
            Self(result)
        }
        #[inline]
        fn sign(self) -> Self {
            let mut result = self.0;
            for lane in 0..W {
                result[lane] = Real::sign(self.0[lane]);
            }
            Self(result)
        }
        #[inline]
        fn min(self, other: Self) -> Self {
            let mut result = self.0;
            for lane in 0..W {
                result[lane] = Real::min(self.0[lane], other.0[lane]);
            }
            Self(result)
        }
        #[inline]
        fn max(self, other: Self) -> Self {
            let mut result = self.0;
            for lane in 0..W {
                result[lane] = Real::max(self.0[lane], other.0[lane]);
            }
            Self(result)
        }
        #[inline]
        fn powi(self, exponent: i32) -> Self {
            integer_power(self, exponent)
        }
        #[inline]
        fn less(self, other: Self) -> [bool; W] {
            let mut mask = [false; W];
            for lane in 0..W {
                mask[lane] = self.0[lane] < other.0[lane];
            }
            mask
        }
        #[inline]
        fn less_or_equal(self, other: Self) -> [bool; W] {
            let mut mask = [false; W];
            for lane in 0..W {
                mask[lane] = self.0[lane] <= other.0[lane];
            }
            mask
        }
        #[inline]
        fn select(mask: [bool; W], then: Self, otherwise: Self) -> Self {
            let mut result = otherwise.0;
            for lane in 0..W {
                if mask[lane] {
                    result[lane] = then.0[lane];
                }
            }
            Self(result)
        }
    };
}

elementary! {
    in lanes {
        exp() = exp, exp, expf of exponential;
        ln() = ln, log, logf of exponential;
        tanh() = tanh, tanh, tanhf of exponential;
        powf(exponent) = powf, pow, powf of exponential;
        atan() = atan, atan, atanf of arctangent;
        atan2(x) = atan2, atan2, atan2f of arctangent;
    }
    lane by lane {
        tan() = tan, tan, tanf;
        asin() = asin, asin, asinf;
        acos() = acos, acos, acosf;
        sinh() = sinh, sinh, sinhf;
        cosh() = cosh, cosh, coshf;
        asinh() = asinh, asinh, asinhf;
        acosh() = acosh, acosh, acoshf;
        atanh() = atanh, atanh, atanhf;
        sqrt() = sqrt, sqrt, sqrtf;
        hypot(other) = hypot, hypot, hypotf;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_powers_of_both_signs() {
        assert_eq!(Real::powi(2.0_f64, 10), 1024.0);
        assert_eq!(Real::powi(2.0_f64, -2), 0.25);
        assert_eq!(Real::powi(0.0_f64, 0), 1.0);
        assert_eq!(Real::powi(1.0_f32, i32::MIN), 1.0);
    }

    #[test]
    fn lanes_do_what_numbers_do() {
        let x = Lanes([0.3, -1.2, 4.0, 0.0]);
        let y = Lanes([1.0, 2.0, -0.5, 3.0]);
        let (sin, cos) = x.sin_cos();
        let value = sin * y + cos / (y + Lanes::from_f64(4.0)) - x.powi(3);
        for lane in 0..4 {
            let (x, y) = (x.0[lane], y.0[lane]);
            let (sin, cos) = Real::sin_cos(x);
            let expected = sin * y + cos / (y + 4.0) - Real::powi(x, 3);
            // Sine and cosine of lanes may differ by a unit in the last place.
            let scale = (sin * y).abs() + cos.abs() + Real::powi(x, 3).abs();
            assert!((value.0[lane] - expected).abs() <= 2.0 * f64::EPSILON * scale);
        }
        let chosen = Real::select(x.less(y), x, y);
        assert_eq!(chosen, x.min(y));
    }

    #[test]
    fn a_nan_is_not_swallowed() {
        assert!(Real::max(f64::NAN, 1.0).is_nan());
        assert!(Real::max(1.0, f64::NAN).is_nan());
        assert!(Real::min(1.0, f64::NAN).is_nan());
        assert!(Real::sign(f64::NAN).is_nan());
    }

    #[test]
    fn the_sign_of_zero_is_zero() {
        assert_eq!(Real::sign(0.0_f64), 0.0);
        assert_eq!(Real::sign(-3.0_f64), -1.0);
    }
}
