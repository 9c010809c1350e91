//! Sine and cosine of several numbers at once, without branches: the same digits on every processor.
//!
//! ```text
//! x = n π/2 + y ,   |y| ≤ π/4 ,   sin y and cos y by polynomials, exchanged and negated as n mod 4 says.
//! ```
//!
//! π/2 is taken in four parts of 33 bits and more, so that n times the first three is exact and y keeps its digits near the zeros, with a
//! second word for what rounding takes. The parts and the minimax polynomials are those of fdlibm (S. Moshier's and K. C. Ng's forms of the
//! remainder), which are accurate to 2⁻⁵⁸; products and sums in a row are fused. The loops have no calls and no branches, so that the compiler makes vector instructions of them
//! on every target.
//! Arguments beyond [`LIMIT`] and those that are not finite are rare and go to the functions of the system.
//!
//! Measured over two million arguments they differ from those functions, which are good to less than a unit in the last place, by one such unit
//! at most, and at one argument in twenty. A single number is left to those functions: alone, it is faster there.

use crate::real::{Real, fused};

/// The largest argument that is reduced here.
pub(crate) const LIMIT: f64 = 1e5;

/// Adding it rounds to a whole number, which the last bits of the sum then hold.
const ROUNDER: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²

const TWO_OVER_PI: f64 = core::f64::consts::FRAC_2_PI;

/// The parts of π/2.
const PART_1: f64 = 1.570_796_326_734_125_6;
const PART_2: f64 = 6.077_100_506_303_966e-11;
const PART_3: f64 = 2.022_266_248_711_166_5e-21;
const PART_4: f64 = 8.478_427_660_368_9e-32;

const SIN: [f64; 6] = [
    -0.166_666_666_666_666_32,
    0.008_333_333_333_322_49,
    -0.000_198_412_698_298_579_5,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

const COS: [f64; 6] = [
    0.041_666_666_666_666_6,
    -0.001_388_888_888_887_411,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// sin x and cos x of W numbers.
#[inline]
pub(crate) fn sin_cos<const W: usize>(x: &[f64; W]) -> ([f64; W], [f64; W]) {
    let (mut sin, mut cos) = ([0.0; W], [0.0; W]);
    for lane in 0..W {
        (sin[lane], cos[lane]) = reduced(x[lane]);
    }
    if !are_small(x) {
        for lane in 0..W {
            if !(x[lane].abs() <= LIMIT) {
                (sin[lane], cos[lane]) = Real::sin_cos(x[lane]);
            }
        }
    }
    (sin, cos)
}

#[inline(always)]
fn are_small<const W: usize>(x: &[f64; W]) -> bool {
    let mut small = true;
    for lane in 0..W {
        small &= x[lane].abs() <= LIMIT;
    }
    small
}

/// Numbers whose sine and cosine are computed here.
pub(crate) trait Turn: Real {
    /// sin x and cos x from those of x − n π/2; n is in the last bits of `quadrant`.
    fn turned(sin: Self, cos: Self, quadrant: Self) -> (Self, Self);

    /// `self` · `factor` + `term` with one rounding ([`fused`]).
    fn fused(self, factor: Self, term: Self) -> Self;
}

impl Turn for f64 {
    #[inline(always)]
    fn turned(sin: Self, cos: Self, quadrant: Self) -> (Self, Self) {
        let (sin, cos, quadrant) = (sin.to_bits(), cos.to_bits(), quadrant.to_bits());
        // All ones where sine and cosine change places.
        let exchange = 0_u64.wrapping_sub(quadrant & 1);
        let difference = (sin ^ cos) & exchange;
        let sin_sign = (quadrant & 2) << 62;
        let cos_sign = (quadrant.wrapping_add(1) & 2) << 62;
        (
            Self::from_bits((sin ^ difference) ^ sin_sign),
            Self::from_bits((cos ^ difference) ^ cos_sign),
        )
    }

    #[inline(always)]
    fn fused(self, factor: Self, term: Self) -> Self {
        fused(self, factor, term)
    }
}

/// sin x and cos x for |x| ≤ [`LIMIT`].
#[inline(always)]
pub(crate) fn reduced<R: Turn>(x: R) -> (R, R) {
    // Written out: closures would be compiled for the instruction set of the crate, not for that of the place of the call.
    let shifted = x.fused(x.like(TWO_OVER_PI), x.like(ROUNDER));
    let n = shifted - x.like(ROUNDER);

    let first = n.fused(x.like(-PART_1), x);
    let part = n * x.like(PART_2);
    let second = first - part;
    let lost_2 = (first - second) - part;
    let part = n * x.like(PART_3);
    let third = second - part;
    let lost_3 = (second - third) - part;
    let rest = n.fused(x.like(PART_4), -(lost_2 + lost_3));
    let y = third - rest;
    let low = (third - y) - rest;

    // Polynomials by halves (Estrin), so that no chain of operations is long.
    let z = y * y;
    let (square, cube) = (z * z, z * y);
    let upper = square.fused(x.like(SIN[5]), z.fused(x.like(SIN[4]), x.like(SIN[3])));
    let tail = square.fused(upper, z.fused(x.like(SIN[2]), x.like(SIN[1])));
    let bend = z.fused((-cube).fused(tail, x.like(0.5) * low), -low);
    let sin = y - cube.fused(x.like(-SIN[0]), bend);
    let upper = square.fused(
        z.fused(x.like(COS[5]), x.like(COS[4])),
        z.fused(x.like(COS[3]), x.like(COS[2])),
    );
    let tail = square.fused(upper, z.fused(x.like(COS[1]), x.like(COS[0])));
    let (half, one) = (x.like(0.5) * z, x.like(1.0));
    let most = one - half;
    let cos = most + (((one - most) - half) + square.fused(tail, -(y * low)));
    R::turned(sin, cos, shifted)
}
