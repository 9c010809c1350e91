//! The scalars that fill a register of an instruction set: their operations, for any such register. The rules are those
//! of [`quad`](crate::registers::quad).

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

        crate::registers::register::operators! {
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

            crate::registers::register::lane_by_lane! {
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
            crate::registers::register::lane_by_lane!(@ self, $name $(, $argument)*)
        }
    )*};
    (@ $self:ident, $name:ident) => { $self.each(<f64 as crate::real::Real>::$name) };
    (@ $self:ident, $name:ident, $argument:ident) => { $self.both($argument, <f64 as crate::real::Real>::$name) };
}
pub(crate) use {lane_by_lane, operators, register};
