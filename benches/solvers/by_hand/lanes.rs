//! Four numbers in an AVX2 register.

use core::ops::{Add, Div, Mul, Neg, Sub};
use pulp::x86::V3;
use pulp::{f64x4, u64x4};

/// A register; it can only be made if the processor has AVX2.
#[derive(Clone, Copy)]
pub struct Quad {
    isa: V3,
    value: f64x4,
}

macro_rules! operators {
    ($($operator:ident $method:ident $instruction:ident;)*) => {$(
        impl $operator for Quad {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { isa: self.isa, value: self.isa.$instruction(self.value, other.value) }
            }
        }
    )*};
}
operators! { Add add add_f64x4; Sub sub sub_f64x4; Mul mul mul_f64x4; Div div div_f64x4; }

impl Neg for Quad {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.splat(0.0) - self
    }
}

impl Quad {
    #[inline(always)]
    pub fn of(isa: V3, lanes: [f64; 4]) -> Self {
        Self {
            isa,
            value: pulp::cast(lanes),
        }
    }

    #[inline(always)]
    pub fn load(self, lanes: [f64; 4]) -> Self {
        Self::of(self.isa, lanes)
    }

    #[inline(always)]
    pub fn splat(self, number: f64) -> Self {
        Self {
            value: self.isa.splat_f64x4(number),
            ..self
        }
    }

    #[inline(always)]
    pub fn lanes(self) -> [f64; 4] {
        pulp::cast(self.value)
    }

    /// `self` · `factor` + `term`
    #[inline(always)]
    pub fn times_plus(self, factor: Self, term: Self) -> Self {
        Self {
            value: self.isa.mul_add_f64x4(self.value, factor.value, term.value),
            ..self
        }
    }

    /// `term` − `self` · `factor`
    #[inline(always)]
    pub fn times_from(self, factor: Self, term: Self) -> Self {
        Self {
            value: self
                .isa
                .negate_mul_add_f64x4(self.value, factor.value, term.value),
            ..self
        }
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self {
            value: self.isa.sqrt_f64x4(self.value),
            ..self
        }
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self {
            value: self.isa.abs_f64x4(self.value),
            ..self
        }
    }

    #[inline(always)]
    pub fn larger(self, other: Self) -> Self {
        Self {
            value: self.isa.max_f64x4(self.value, other.value),
            ..self
        }
    }

    #[inline(always)]
    pub fn smaller(self, other: Self) -> Self {
        Self {
            value: self.isa.min_f64x4(self.value, other.value),
            ..self
        }
    }

    #[inline(always)]
    pub fn largest_lane(self) -> f64 {
        let [a, b, c, d] = self.lanes();
        let (left, right) = (if a > b { a } else { b }, if c > d { c } else { d });
        if left > right { left } else { right }
    }

    #[inline(always)]
    pub fn sum_of_lanes(self) -> f64 {
        let [a, b, c, d] = self.lanes();
        (a + c) + (b + d)
    }

    /// x − n π, and n in the last bits of a number; for |x| up to some thousands.
    #[inline(always)]
    fn reduced(self) -> (Self, Self) {
        const ROUNDER: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²
        const PI_LOW: f64 = 1.224_646_799_147_353_2e-16;
        let shifted = self.times_plus(
            self.splat(core::f64::consts::FRAC_1_PI),
            self.splat(ROUNDER),
        );
        let n = shifted - self.splat(ROUNDER);
        let rest = n.times_from(self.splat(core::f64::consts::PI), self);
        (n.times_from(self.splat(PI_LOW), rest), shifted)
    }

    /// Negative if the last bit of `count` is set.
    #[inline(always)]
    fn with_sign_of(self, count: Self) -> Self {
        let (bits, count): (u64x4, u64x4) = (pulp::cast(self.value), pulp::cast(count.value));
        let sign = self.isa.shl_const_u64x4::<63>(count);
        Self {
            value: pulp::cast(self.isa.xor_u64x4(bits, sign)),
            ..self
        }
    }

    #[inline(always)]
    pub fn sin(self) -> Self {
        let (rest, count) = self.reduced();
        rest.sin_of_rest().with_sign_of(count)
    }

    #[inline(always)]
    pub fn sin_cos(self) -> (Self, Self) {
        let (rest, count) = self.reduced();
        (
            rest.sin_of_rest().with_sign_of(count),
            rest.cos_of_rest().with_sign_of(count),
        )
    }

    #[inline(always)]
    fn sin_of_rest(self) -> Self {
        let z = self * self;
        (self * z).times_plus(self.polynomial(z, &SIN), self)
    }

    #[inline(always)]
    fn cos_of_rest(self) -> Self {
        let z = self * self;
        z.times_plus(self.polynomial(z, &COS), self.splat(1.0))
    }

    /// A polynomial with ten coefficients, evaluated by Estrin's scheme.
    #[inline(always)]
    fn polynomial(self, z: Self, c: &[f64; 10]) -> Self {
        let square = z * z;
        let fourth = square * square;
        let first = z.times_plus(self.splat(c[1]), self.splat(c[0]));
        let second = z.times_plus(self.splat(c[3]), self.splat(c[2]));
        let third = z.times_plus(self.splat(c[5]), self.splat(c[4]));
        let last = z.times_plus(self.splat(c[7]), self.splat(c[6]));
        let end = z.times_plus(self.splat(c[9]), self.splat(c[8]));
        let lower = square.times_plus(second, first);
        let upper = square.times_plus(last, third);
        fourth.times_plus(fourth.times_plus(end, upper), lower)
    }
}

const SIN: [f64; 10] = taylor(3.0);
const COS: [f64; 10] = taylor(2.0);

/// The coefficients −1/n!, 1/(n + 2)!, …
const fn taylor(from: f64) -> [f64; 10] {
    let (mut coefficients, mut n) = ([0.0; 10], from);
    let mut term = if from == 2.0 { -0.5 } else { -1.0 / 6.0 };
    let mut i = 0;
    while i < 10 {
        coefficients[i] = term;
        term /= -((n + 1.0) * (n + 2.0));
        (n, i) = (n + 2.0, i + 1);
    }
    coefficients
}
