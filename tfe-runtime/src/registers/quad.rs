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
use crate::registers::four::OutOfLine;
use crate::registers::pair::Pair;
use crate::trigonometry::{LIMIT, Turn, cos_of_small, reduced, sin_of_small};
use pulp::x86::V3;
use pulp::{Simd, f64x4, m64x4, u64x4};

crate::registers::register::register! {
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
        self.isa.avx._mm256_movemask_pd(pulp::cast(mask)) == 0b1111
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
    pub(crate) fn out_of_line<W: OutOfLine>(self, work: W) {
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

impl<W: OutOfLine> pulp::NullaryFnOnce for Call<W> {
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
