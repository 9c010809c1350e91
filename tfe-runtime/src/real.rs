//! The scalar of generated kernels.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A number that kernels compute with: `f64`, `f32`, or several `f64` side by side.
///
/// Only generated kernels are generic over it; the algorithms of this crate work in `f64`.
pub trait Real:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// What a comparison gives: `bool`, or one truth value a lane.
    type Mask: Copy;

    /// The nearest number to `value`.
    fn from_f64(value: f64) -> Self;
    /// `value` as a number of the same kind as `self`: kernels make their constants with it. `self` carries what a
    /// number in processor registers needs to know, such as the instruction set.
    #[inline(always)]
    #[must_use]
    fn like(self, value: f64) -> Self {
        Self::from_f64(value)
    }
    /// The parameter `index` of a model ([`Model::parameter_name`](crate::Model::parameter_name)) with this value, as a
    /// number of the same kind as `self`: kernels make it from the fields of a model. If `self` carries the index of a
    /// parameter by which derivatives are taken, that parameter gets its slope here.
    #[inline(always)]
    #[must_use]
    fn parameter(self, _index: usize, value: f64) -> Self {
        self.like(value)
    }
    /// sin x and cos x together.
    fn sin_cos(self) -> (Self, Self);
    /// sin x.
    fn sin(self) -> Self;
    /// cos x.
    fn cos(self) -> Self;
    /// tan x.
    fn tan(self) -> Self;
    /// arcsin x.
    fn asin(self) -> Self;
    /// arccos x.
    fn acos(self) -> Self;
    /// arctan x.
    fn atan(self) -> Self;
    /// Angle of the point (x, self), in (−π, π].
    fn atan2(self, x: Self) -> Self;
    /// sinh x.
    fn sinh(self) -> Self;
    /// cosh x.
    fn cosh(self) -> Self;
    /// tanh x.
    fn tanh(self) -> Self;
    /// arsinh x.
    fn asinh(self) -> Self;
    /// arcosh x.
    fn acosh(self) -> Self;
    /// artanh x.
    fn atanh(self) -> Self;
    /// eˣ.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// √x.
    fn sqrt(self) -> Self;
    /// |x|.
    fn abs(self) -> Self;
    /// −1, 0 or 1: the sign of x, with sign(0) = 0.
    fn sign(self) -> Self;
    /// The smaller one.
    fn min(self, other: Self) -> Self;
    /// The larger one.
    fn max(self, other: Self) -> Self;
    /// √(x² + y²).
    fn hypot(self, other: Self) -> Self;
    /// xⁿ.
    fn powi(self, exponent: i32) -> Self;
    /// xʸ.
    fn powf(self, exponent: Self) -> Self;
    /// x < y.
    fn less(self, other: Self) -> Self::Mask;
    /// x ≤ y.
    fn less_or_equal(self, other: Self) -> Self::Mask;
    /// `then` where the mask holds, `otherwise` elsewhere.
    fn select(mask: Self::Mask, then: Self, otherwise: Self) -> Self;
    /// Applies a function that kernels do not know, such as an input of a model, lane by lane. The default, for scalars
    /// that do not implement it, is NaN.
    #[must_use]
    fn map(self, _function: &mut dyn FnMut(f64) -> f64) -> Self {
        self.like(f64::NAN)
    }
    /// The same with known derivatives: `derivatives(k, x)` is the k-th derivative at x, and `derivatives(0, x)` the
    /// function. Numbers with slopes use these instead of differences, which would see the other side of a jump.
    #[must_use]
    fn map_with_derivatives(self, derivatives: &mut dyn FnMut(u32, f64) -> f64) -> Self {
        self.map(&mut |x| derivatives(0, x))
    }
}

/// x y + z with one rounding on processors with vector registers, where it is one instruction; with two roundings
/// without the feature `simd`, where it would be a function call. A program gives the same digits on every processor.
#[inline(always)]
pub(crate) fn fused(x: f64, y: f64, z: f64) -> f64 {
    #[cfg(all(feature = "simd", feature = "std"))]
    {
        x.mul_add(y, z)
    }
    #[cfg(all(feature = "simd", not(feature = "std")))]
    {
        libm::fma(x, y, z)
    }
    #[cfg(not(feature = "simd"))]
    {
        x * y + z
    }
}

/// xⁿ by repeated squaring, so that every scalar and every target gives the same digits.
#[inline(always)]
pub(crate) fn integer_power<R: Real>(base: R, exponent: i32) -> R {
    let mut remaining = exponent.unsigned_abs();
    let mut square = base;
    let mut power = base.like(1.0);
    while remaining > 0 {
        if remaining & 1 == 1 {
            power = power * square;
        }
        remaining >>= 1;
        if remaining > 0 {
            square = square * square;
        }
    }
    if exponent < 0 {
        base.like(1.0) / power
    } else {
        power
    }
}
