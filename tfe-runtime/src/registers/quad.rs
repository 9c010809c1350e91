//! Scalars in registers of the processor, chosen at run time: four numbers with AVX2.
//!
//! The operations are those of IEEE 754, so that a kernel gives the same digits as with plain numbers. Products with
//! tables, and the polynomials of sines and exponentials, use fused multiply-adds. Without these registers they do as
//! well ([`fused`](crate::real::fused)), although on old processors that is a function call. Sine and cosine are those
//! of [`trigonometry`](crate::trigonometry); exponential, logarithm, hyperbolic tangent and power those of
//! [`exponential`](crate::exponential); angles those of [`arctangent`](crate::arctangent). Code that computes with
//! these numbers has to be compiled for that instruction set; therefore everything is inlined, and the outermost call
//! goes through [`pulp`].

use crate::real::Real;
use crate::registers::four::Apart;
use crate::registers::pair::Pair;
use crate::trigonometry::{LIMIT, Turn, cos_of_small, reduced, sin_of_small};
use pulp::x86::V3;
use pulp::{Simd, f64x4, m64x4, u64x4};

/// Defines a type of numbers that fill a register of an instruction set.
macro_rules! register {
    (
        $(#[$doc:meta])*
        $name:ident: $count:literal of $isa:ident,
        $value:ident, $mask:ident, $bits:ident, $product_less:ident, $fused:ident, $shift:ident, $shift_right:ident
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct $name {
            isa: $isa,
            value: $value,
        }

        impl $name {
            #[inline(always)]
            pub(crate) fn of(isa: $isa, lanes: [f64; $count]) -> Self {
                Self {
                    isa,
                    value: pulp::cast(lanes),
                }
            }

            /// The same kind of numbers as `self` with these values.
            #[inline(always)]
            pub(crate) fn with(self, lanes: [f64; $count]) -> Self {
                Self::of(self.isa, lanes)
            }

            #[inline(always)]
            pub(crate) fn lanes(self) -> [f64; $count] {
                pulp::cast(self.value)
            }

            /// A function without an instruction of its own, applied to one lane after the other.
            #[inline(always)]
            fn each(self, function: impl Fn(f64) -> f64) -> Self {
                let mut lanes = self.lanes();
                for lane in 0..$count {
                    lanes[lane] = function(lanes[lane]);
                }
                self.with(lanes)
            }

            /// `found`, with the lanes whose argument is outside the limits replaced by a scalar function.
            #[inline(always)]
            fn or_by_lanes(
                self,
                found: Self,
                limits: (f64, f64),
                function: impl Fn(f64) -> f64,
            ) -> Self {
                if self.is_within(limits) {
                    return found;
                }
                let (x, mut found) = (self.lanes(), found.lanes());
                crate::trigonometry::replace_outside(&x, &mut found, limits, function);
                self.with(found)
            }

            /// The same for functions of two arguments, each with its limits.
            #[inline(always)]
            fn or_by_lanes_of_two(
                self,
                other: Self,
                found: Self,
                [(first, limits), (second, more_limits)]: [(Self, (f64, f64)); 2],
                function: impl Fn(f64, f64) -> f64,
            ) -> Self {
                if first.is_within(limits) & second.is_within(more_limits) {
                    return found;
                }
                let mut values = found.lanes();
                crate::trigonometry::replace_outside_of_two(
                    [(&first.lanes(), limits), (&second.lanes(), more_limits)],
                    (&self.lanes(), &other.lanes()),
                    &mut values,
                    function,
                );
                self.with(values)
            }

            #[inline(always)]
            fn both(self, other: Self, function: impl Fn(f64, f64) -> f64) -> Self {
                let (mut lanes, other) = (self.lanes(), other.lanes());
                for lane in 0..$count {
                    lanes[lane] = function(lanes[lane], other[lane]);
                }
                self.with(lanes)
            }
        }

        impl crate::precise::Precise for $name {
            /// With a fused multiply-add the second number, the rounding error, is exact.
            #[inline(always)]
            fn product(self, other: Self) -> (Self, Self) {
                let high = self.isa.mul_f64s(self.value, other.value);
                let low = self.isa.$product_less(self.value, other.value, high);
                (
                    Self {
                        value: high,
                        ..self
                    },
                    Self { value: low, ..self },
                )
            }

            #[inline(always)]
            fn times_plus(self, factor: Self, term: Self) -> Self {
                let value = self.isa.$fused(self.value, factor.value, term.value);
                Self { value, ..self }
            }

            /// Of a NaN and another number, the second operand.
            #[inline(always)]
            fn larger(self, other: Self) -> Self {
                let value = self.isa.max_f64s(self.value, other.value);
                Self { value, ..self }
            }
        }

        crate::registers::quad::operators! {
            $name: Add add add_f64s; Sub sub sub_f64s; Mul mul mul_f64s; Div div div_f64s;
        }

        impl core::ops::Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                let value = self.isa.neg_f64s(self.value);
                Self { value, ..self }
            }
        }

        impl core::ops::AddAssign for $name {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl core::ops::SubAssign for $name {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }

        impl crate::real::Real for $name {
            type Mask = $mask;

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                // Slow, and only for kernels written by hand: `like` need not detect the processor.
                let isa = $isa::try_new().expect("these numbers exist on processors that have them only");
                Self::of(isa, [value; $count])
            }

            #[inline(always)]
            fn like(self, value: f64) -> Self {
                let value = self.isa.splat_f64s(value);
                Self { value, ..self }
            }

            fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
                self.with(self.lanes().map(function))
            }

            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                let (sin, cos) = crate::trigonometry::reduced(self);
                if self.is_within((-LIMIT, LIMIT)) {
                    return (sin, cos);
                }
                let (x, mut sin, mut cos) = (self.lanes(), sin.lanes(), cos.lanes());
                for lane in 0..$count {
                    if !(x[lane].abs() <= LIMIT) {
                        (sin[lane], cos[lane]) = crate::real::Real::sin_cos(x[lane]);
                    }
                }
                (self.with(sin), self.with(cos))
            }

            #[inline(always)]
            fn sin(self) -> Self {
                self.or_by_lanes(
                    crate::trigonometry::sin_of_small(self),
                    (-LIMIT, LIMIT),
                    <f64 as crate::real::Real>::sin,
                )
            }

            #[inline(always)]
            fn cos(self) -> Self {
                self.or_by_lanes(
                    crate::trigonometry::cos_of_small(self),
                    (-LIMIT, LIMIT),
                    <f64 as crate::real::Real>::cos,
                )
            }

            #[inline(always)]
            fn exp(self) -> Self {
                self.or_by_lanes(
                    crate::exponential::exp_of_small(self),
                    (-crate::exponential::EXP_LIMIT, crate::exponential::EXP_LIMIT),
                    <f64 as crate::real::Real>::exp,
                )
            }

            #[inline(always)]
            fn ln(self) -> Self {
                self.or_by_lanes(
                    crate::exponential::ln_of_normal(self),
                    crate::exponential::LN_LIMITS,
                    <f64 as crate::real::Real>::ln,
                )
            }

            #[inline(always)]
            fn tanh(self) -> Self {
                self.or_by_lanes(
                    crate::exponential::tanh_of_finite(self),
                    (-crate::exponential::TANH_LIMIT, crate::exponential::TANH_LIMIT),
                    <f64 as crate::real::Real>::tanh,
                )
            }

            crate::registers::quad::lane_by_lane! {
                tan(); asin(); acos(); sinh(); cosh(); asinh(); acosh(); atanh(); hypot(other);
            }

            #[inline(always)]
            fn atan(self) -> Self {
                crate::real::Real::atan2(self, self.like(1.0))
            }

            #[inline(always)]
            fn atan2(self, x: Self) -> Self {
                use crate::arctangent::{FINITE, ORDINARY, atan2_of_ordinary};
                let found = atan2_of_ordinary(self, x);
                let limits = [(crate::real::Real::abs(self), ORDINARY), (x, FINITE)];
                self.or_by_lanes_of_two(x, found, limits, <f64 as crate::real::Real>::atan2)
            }

            #[inline(always)]
            fn powf(self, exponent: Self) -> Self {
                use crate::exponential::{EXP_LIMIT, LN_LIMITS, power_of_ordinary};
                let (found, product) = power_of_ordinary(self, exponent);
                let limits = [(self, LN_LIMITS), (product, (-EXP_LIMIT, EXP_LIMIT))];
                self.or_by_lanes_of_two(exponent, found, limits, <f64 as crate::real::Real>::powf)
            }

            /// NaN and zeros are returned unchanged.
            #[inline(always)]
            fn sign(self) -> Self {
                let (zero, one) = (self.like(0.0), self.like(1.0));
                let negative = Self::select(self.less(zero), -one, self);
                Self::select(zero.less(self), one, negative)
            }

            /// A NaN in either operand is kept.
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                let smaller = Self::select(other.less(self), other, self);
                Self::select(other.less_or_equal(other), smaller, other)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                let larger = Self::select(self.less(other), other, self);
                Self::select(other.less_or_equal(other), larger, other)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                let value = self.isa.sqrt_f64s(self.value);
                Self { value, ..self }
            }

            #[inline(always)]
            fn abs(self) -> Self {
                let value = self.isa.abs_f64s(self.value);
                Self { value, ..self }
            }

            #[inline(always)]
            fn powi(self, exponent: i32) -> Self {
                crate::real::integer_power(self, exponent)
            }

            #[inline(always)]
            fn less(self, other: Self) -> $mask {
                self.isa.less_than_f64s(self.value, other.value)
            }

            #[inline(always)]
            fn less_or_equal(self, other: Self) -> $mask {
                self.isa.less_than_or_equal_f64s(self.value, other.value)
            }

            #[inline(always)]
            fn select(mask: $mask, then: Self, otherwise: Self) -> Self {
                let value = then.isa.select_f64s(mask, then.value, otherwise.value);
                Self { value, ..then }
            }
        }

        impl crate::exponential::Scale for $name {
            #[inline(always)]
            fn times_power_of_two(self, count: Self) -> Self {
                let (value, count): ($bits, $bits) = (pulp::cast(self.value), pulp::cast(count.value));
                let exponent = self.isa.$shift::<52>(count);
                let value = pulp::cast(self.isa.add_u64s(value, exponent));
                Self { value, ..self }
            }

            #[inline(always)]
            fn parted(self) -> (Self, Self) {
                use crate::exponential::{BIAS, FRACTION, HALF_ROOT, SHIFTED, TO_ONE};
                let isa = self.isa;
                let bits = isa.add_u64s(pulp::cast(self.value), isa.splat_u64s(TO_ONE));
                let fraction = isa.and_u64s(bits, isa.splat_u64s(FRACTION));
                let part = isa.add_u64s(fraction, isa.splat_u64s(HALF_ROOT));
                let exponent = isa.or_u64s(
                    isa.$shift_right::<52>(bits),
                    isa.splat_u64s(SHIFTED.to_bits()),
                );
                let (part, exponent) = (pulp::cast(part), pulp::cast(exponent));
                let exponent = Self { isa, value: exponent };
                (Self { isa, value: part }, exponent - crate::real::Real::like(self, SHIFTED + BIAS))
            }
        }

        impl crate::trigonometry::Turn for $name {
            #[inline(always)]
            fn fused(self, factor: Self, term: Self) -> Self {
                crate::precise::Precise::times_plus(self, factor, term)
            }

            #[inline(always)]
            fn negated_if_odd(self, count: Self) -> Self {
                let (value, count): ($bits, $bits) = (pulp::cast(self.value), pulp::cast(count.value));
                let sign = self.isa.$shift::<63>(count);
                let value = pulp::cast(self.isa.xor_u64s(value, sign));
                Self { value, ..self }
            }

            #[inline(always)]
            fn turned(sin: Self, cos: Self, quadrant: Self) -> (Self, Self) {
                let isa = sin.isa;
                let (sin, cos, quadrant): ($bits, $bits, $bits) = (
                    pulp::cast(sin.value),
                    pulp::cast(cos.value),
                    pulp::cast(quadrant.value),
                );
                let (one, two) = (isa.splat_u64s(1), isa.splat_u64s(2));
                // The same as for a single number.
                let exchange = isa.sub_u64s(isa.splat_u64s(0), isa.and_u64s(quadrant, one));
                let difference = isa.and_u64s(isa.xor_u64s(sin, cos), exchange);
                let next = isa.add_u64s(quadrant, one);
                let sin_sign = isa.$shift::<62>(isa.and_u64s(quadrant, two));
                let cos_sign = isa.$shift::<62>(isa.and_u64s(next, two));
                let sin = isa.xor_u64s(isa.xor_u64s(sin, difference), sin_sign);
                let cos = isa.xor_u64s(isa.xor_u64s(cos, difference), cos_sign);
                let (sin, cos) = (pulp::cast(sin), pulp::cast(cos));
                (Self { isa, value: sin }, Self { isa, value: cos })
            }
        }
    };
}

macro_rules! operators {
    ($name:ident: $($operator:ident $method:ident $instruction:ident;)*) => {$(
        impl core::ops::$operator for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let value = self.isa.$instruction(self.value, other.value);
                Self { isa: self.isa, value }
            }
        }
    )*};
}

macro_rules! lane_by_lane {
    ($($name:ident($($argument:ident),*);)*) => {$(
        #[inline(always)]
        fn $name(self $(, $argument: Self)*) -> Self {
            crate::registers::quad::lane_by_lane!(@ self, $name $(, $argument)*)
        }
    )*};
    (@ $self:ident, $name:ident) => { $self.each(<f64 as crate::real::Real>::$name) };
    (@ $self:ident, $name:ident, $argument:ident) => { $self.both($argument, <f64 as crate::real::Real>::$name) };
}
pub(crate) use {lane_by_lane, operators, register};

register! {
    /// Four numbers, and the proof that the processor has registers for them.
    Quad: 4 of V3,
    f64x4, m64x4, u64x4, mul_sub_f64x4, mul_add_f64x4, shl_const_u64x4, shr_const_u64x4
}

/// Defines an interleaving of the lanes of two registers.
macro_rules! interleaved {
    ($($(#[$doc:meta])* $name:ident: $instruction:ident $($which:literal)?;)*) => {$(
        $(#[$doc])*
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            let (a, b) = (pulp::cast(self.value), pulp::cast(other.value));
            let value = pulp::cast(self.isa.avx.$instruction $(::<$which>)? (a, b));
            Self { value, ..self }
        }
    )*};
}

impl Quad {
    interleaved! {
        /// [a₀, b₀, a₂, b₂]
        even: _mm256_unpacklo_pd;
        /// [a₁, b₁, a₃, b₃]
        odd: _mm256_unpackhi_pd;
        /// [a₀, a₁, b₀, b₁]
        lower: _mm256_permute2f128_pd 0x20;
        /// [a₂, a₃, b₂, b₃]
        upper: _mm256_permute2f128_pd 0x31;
    }

    /// The mask of lanes within the limits.
    #[inline(always)]
    fn within(self, (low, high): (f64, f64)) -> m64x4 {
        let (isa, high_value) = (self.isa, self.like(high).value);
        // The limits are constants: one comparison suffices if they are opposite.
        if low == -high {
            return isa.less_than_or_equal_f64s(isa.abs_f64s(self.value), high_value);
        }
        let above = isa.less_than_or_equal_f64s(self.like(low).value, self.value);
        isa.and_m64x4(above, isa.less_than_or_equal_f64s(self.value, high_value))
    }

    /// Whether a mask has all lanes.
    #[inline(always)]
    fn has_all(self, mask: m64x4) -> bool {
        self.isa.first_true_m64s(self.isa.not_m64x4(mask)) == 4
    }

    /// Whether all lanes are within limits.
    #[inline(always)]
    fn is_within(self, limits: (f64, f64)) -> bool {
        self.has_all(self.within(limits))
    }

    /// The transposed matrix, in eight instructions; from code that handles lane by lane the compiler makes nineteen.
    #[inline(always)]
    pub(crate) fn transposed([a, b, c, d]: [Self; 4]) -> [Self; 4] {
        let (first, second) = (a.even(b), a.odd(b));
        let (third, fourth) = (c.even(d), c.odd(d));
        [
            first.lower(third),
            second.lower(fourth),
            first.upper(third),
            second.upper(fourth),
        ]
    }

    /// Runs work in a function of its own.
    #[inline(always)]
    pub(crate) fn apart<W: Apart>(self, work: W) {
        self.isa.vectorize(Call {
            isa: self.isa,
            work,
        });
    }

    /// Whether all arguments of both are within the limits of `trigonometry`.
    #[inline(always)]
    fn are_turns(self, other: Self) -> bool {
        let limits = (-LIMIT, LIMIT);
        self.has_all(
            self.isa
                .and_m64x4(self.within(limits), other.within(limits)),
        )
    }

    /// sin of both: the chains of operations overlap, and constants are loaded once.
    #[inline(always)]
    pub(crate) fn sin_of_two(self, other: Self) -> (Self, Self) {
        if !self.are_turns(other) {
            return (self.sin(), other.sin());
        }
        let sin = sin_of_small(Pair(self, other));
        (sin.0, sin.1)
    }

    /// cos of both.
    #[inline(always)]
    pub(crate) fn cos_of_two(self, other: Self) -> (Self, Self) {
        if !self.are_turns(other) {
            return (self.cos(), other.cos());
        }
        let cos = cos_of_small(Pair(self, other));
        (cos.0, cos.1)
    }

    /// sin and cos of both.
    #[inline(always)]
    pub(crate) fn sin_cos_of_two(self, other: Self) -> ((Self, Self), (Self, Self)) {
        if !self.are_turns(other) {
            return (self.sin_cos(), other.sin_cos());
        }
        let (sin, cos) = reduced(Pair(self, other));
        ((sin.0, cos.0), (sin.1, cos.1))
    }
}

struct Call<W> {
    isa: V3,
    work: W,
}

impl<W: Apart> pulp::NullaryFnOnce for Call<W> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.work.run(Quad::of(self.isa, [0.0; 4]));
    }
}

impl Turn for Pair<Quad> {
    #[inline(always)]
    fn fused(self, factor: Self, term: Self) -> Self {
        Self(
            self.0.fused(factor.0, term.0),
            self.1.fused(factor.1, term.1),
        )
    }

    #[inline(always)]
    fn negated_if_odd(self, count: Self) -> Self {
        Self(
            self.0.negated_if_odd(count.0),
            self.1.negated_if_odd(count.1),
        )
    }

    #[inline(always)]
    fn turned(sin: Self, cos: Self, quadrant: Self) -> (Self, Self) {
        let first = Quad::turned(sin.0, cos.0, quadrant.0);
        let second = Quad::turned(sin.1, cos.1, quadrant.1);
        (Self(first.0, second.0), Self(first.1, second.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_have_the_bits_of_plain_lanes() {
        let Some(isa) = V3::try_new() else {
            return; // Nothing to compare with on this processor.
        };
        for k in 0..2000 {
            let x = f64::from(k) * 0.731;
            let x = [x, -1e-3 * x, 50.0 * x, 1e3 * x];
            let register = Quad::of(isa, x);
            let bits = |numbers: [f64; 4]| numbers.map(f64::to_bits);
            let (sin, cos) = crate::trigonometry::sin_cos(&x);
            let both = register.sin_cos();
            assert_eq!(bits(both.0.lanes()), bits(sin));
            assert_eq!(bits(both.1.lanes()), bits(cos));
            // Two registers, of which the other one is within limits more often.
            let pair = Pair(register, Quad::of(isa, x.map(|x| 1e-2 * x)));
            for (of_two, alone) in [
                (pair.sin(), [pair.0.sin(), pair.1.sin()]),
                (pair.cos(), [pair.0.cos(), pair.1.cos()]),
            ] {
                assert_eq!(bits(of_two.0.lanes()), bits(alone[0].lanes()));
                assert_eq!(bits(of_two.1.lanes()), bits(alone[1].lanes()));
            }
            assert_eq!(
                bits(register.sin().lanes()),
                bits(crate::trigonometry::sin(&x))
            );
            assert_eq!(
                bits(register.cos().lanes()),
                bits(crate::trigonometry::cos(&x))
            );
        }
    }

    #[test]
    fn functions_have_the_bits_of_plain_lanes() {
        let Some(isa) = V3::try_new() else {
            return; // Nothing to compare with on this processor.
        };
        let rare = [
            f64::NAN,
            f64::INFINITY,
            -0.0,
            0.0,
            -1.0,
            5e-324,
            709.5,
            -800.0,
        ];
        for k in 0..2000 {
            let x = f64::from(k - 1000) * 0.0731;
            let other = rare[k as usize % rare.len()];
            let given = if k % 3 == 0 {
                [x, other, -x, 1e-8 * x]
            } else {
                [x, 0.1 * x, x * x, 1e-3 * x]
            };
            let (lanes, register) = (crate::lanes::Lanes(given), Quad::of(isa, given));
            let second = [0.3, x, other, -0.0];
            let (second, in_register) = (crate::lanes::Lanes(second), Quad::of(isa, second));
            // The bits of a NaN may be any.
            let bits = |numbers: [f64; 4]| {
                numbers.map(|x| if x.is_nan() { f64::NAN } else { x }.to_bits())
            };
            for (found, expected) in [
                (register.exp(), lanes.exp()),
                (register.ln(), lanes.ln()),
                (register.tanh(), lanes.tanh()),
                (register.sign(), lanes.sign()),
                (register.min(in_register), lanes.min(second)),
                (register.max(in_register), lanes.max(second)),
                (register.atan(), lanes.atan()),
                (register.atan2(in_register), lanes.atan2(second)),
                (in_register.atan2(register), second.atan2(lanes)),
                (register.powf(in_register), lanes.powf(second)),
                (register.abs().powf(in_register), lanes.abs().powf(second)),
            ] {
                assert_eq!(bits(found.lanes()), bits(expected.0), "{given:?}");
            }
        }
    }
}
