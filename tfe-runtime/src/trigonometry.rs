//! Sine and cosine of several numbers at once, without branches; the digits are the same on every processor.
//!
//! ```text
//! x = n π/2 + y ,   |y| ≤ π/4 ,   sin y and cos y by polynomials, exchanged and negated as n mod 4 says.
//! ```
//!
//! π/2 is taken in three parts of 53 bits: x less n times the first is exact by a fused operation, and y keeps its
//! digits near the zeros, with a second word for what rounding takes. Without the feature `simd`, where nothing is
//! fused, there are four parts of 33 bits and more, so that n times the first three is exact. The four parts and the
//! minimax polynomials are those of fdlibm (S. Moshier's and K. C. Ng's forms of the remainder), which are accurate to
//! 2⁻⁵⁸; products and sums in a row are fused. The loops have no calls and no branches, so that the compiler makes
//! vector instructions of them on every target. Arguments beyond [`LIMIT`] and those that are not finite are rare and
//! go to the functions of the system.
//!
//! Where only one of the two is needed, a reduction by π serves, and one polynomial:
//!
//! ```text
//! x = n π + y ,   |y| ≤ π/2 ,   sin x = (−1)ⁿ sin y ;        cos x = (−1)ⁿ sin(n π + π/2 − x) .
//! ```
//!
//! x − n π₁ is exact by a fused operation, π₁ being π rounded, for all n here; two more parts of π leave y a rounding
//! of its own. That takes a third of the operations of both together. Without the feature `simd` one comes from both.
//!
//! Measured over two million arguments, what gives both differs from the functions of the system, which are good to
//! less than a unit in the last place, by one such unit at most, and at one argument in twenty; what gives one is off
//! by less than 1.5 such units, judged in double-double arithmetic, and loses the sign of zero. A single number is left
//! to those functions: alone, it is faster there.

use crate::real::{Real, fused};

/// The largest argument that is reduced here.
pub(crate) const LIMIT: f64 = 1e5;

/// Adding this constant rounds a number to an integer, which the last bits of the sum then contain.
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

/// The parts of π.
const PI_1: f64 = core::f64::consts::PI;
const PI_2: f64 = 1.224_646_799_147_353_2e-16;
const PI_3: f64 = -2.994_769_809_718_339_7e-33;

/// (sin y − y)/y³ in powers of y² up to π²/4, accurate to 2⁻⁶⁰ except for the rounding of the first coefficient.
const SIN_TO_HALF_PI: [f64; 8] = [
    -0.166_666_666_666_666_66,
    0.008_333_333_333_333_316,
    -0.000_198_412_698_412_549_74,
    2.755_731_921_916_323e-6,
    -2.505_210_761_699_587_8e-8,
    1.605_897_731_244_426_8e-10,
    -7.643_970_296_165_793e-13,
    2.731_444_759_096_34e-15,
];

/// sin x of W numbers.
#[inline]
pub(crate) fn sin<const W: usize>(x: &[f64; W]) -> [f64; W] {
    if cfg!(not(feature = "simd")) {
        // Without fused operations this reduction loses digits.
        return sin_cos(x).0;
    }
    let mut sin = [0.0; W];
    for lane in 0..W {
        sin[lane] = sin_of_small(x[lane]);
    }
    if !are_small(x) {
        replace_outside(x, &mut sin, (-LIMIT, LIMIT), Real::sin);
    }
    sin
}

/// cos x of W numbers.
#[inline]
pub(crate) fn cos<const W: usize>(x: &[f64; W]) -> [f64; W] {
    if cfg!(not(feature = "simd")) {
        return sin_cos(x).1;
    }
    let mut cos = [0.0; W];
    for lane in 0..W {
        cos[lane] = cos_of_small(x[lane]);
    }
    if !are_small(x) {
        replace_outside(x, &mut cos, (-LIMIT, LIMIT), Real::cos);
    }
    cos
}

/// Replaces the results for arguments outside the limits by those of another function.
#[inline(always)]
pub(crate) fn replace_outside<const W: usize>(
    x: &[f64; W],
    values: &mut [f64; W],
    (low, high): (f64, f64),
    function: impl Fn(f64) -> f64,
) {
    for lane in 0..W {
        if !(low <= x[lane] && x[lane] <= high) {
            values[lane] = function(x[lane]);
        }
    }
}

/// The same for a function of two arguments, each with its limits.
#[inline(always)]
pub(crate) fn replace_outside_of_two<const W: usize>(
    [(first, (low, high)), (second, (least, most))]: [(&[f64; W], (f64, f64)); 2],
    (x, y): (&[f64; W], &[f64; W]),
    values: &mut [f64; W],
    function: impl Fn(f64, f64) -> f64,
) {
    for lane in 0..W {
        let (first, second) = (first[lane], second[lane]);
        if !(low <= first && first <= high && least <= second && second <= most) {
            values[lane] = function(x[lane], y[lane]);
        }
    }
}

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

    /// Negates the number where n, in the last bits of `count`, is odd.
    fn negated_if_odd(self, count: Self) -> Self;

    /// `self` · `factor` + `term` with one rounding ([`fused`]).
    fn fused(self, factor: Self, term: Self) -> Self;
}

impl Turn for f64 {
    #[inline(always)]
    fn turned(sin: Self, cos: Self, quadrant: Self) -> (Self, Self) {
        let (sin, cos, quadrant) = (sin.to_bits(), cos.to_bits(), quadrant.to_bits());
        // All bits are one where sine and cosine are exchanged.
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
    fn negated_if_odd(self, count: Self) -> Self {
        Self::from_bits(self.to_bits() ^ (count.to_bits() << 63))
    }

    #[inline(always)]
    fn fused(self, factor: Self, term: Self) -> Self {
        fused(self, factor, term)
    }
}

/// sin x for |x| ≤ [`LIMIT`].
#[inline(always)]
pub(crate) fn sin_of_small<R: Turn>(x: R) -> R {
    let shifted = x.fused(x.like(core::f64::consts::FRAC_1_PI), x.like(ROUNDER));
    let n = shifted - x.like(ROUNDER);
    let y = n.fused(x.like(-PI_1), x);
    let y = n.fused(x.like(-PI_3), n.fused(x.like(-PI_2), y));
    sin_to_half_pi(y).negated_if_odd(shifted)
}

/// cos x for |x| ≤ [`LIMIT`].
#[inline(always)]
pub(crate) fn cos_of_small<R: Turn>(x: R) -> R {
    let turns = x.fused(x.like(core::f64::consts::FRAC_1_PI), x.like(-0.5));
    let shifted = turns + x.like(ROUNDER);
    let n = (shifted - x.like(ROUNDER)) + x.like(0.5);
    let y = n.fused(x.like(PI_1), -x);
    let y = n.fused(x.like(PI_3), n.fused(x.like(PI_2), y));
    sin_to_half_pi(y).negated_if_odd(shifted)
}

/// sin y for |y| ≤ π/2.
#[inline(always)]
fn sin_to_half_pi<R: Turn>(y: R) -> R {
    let c = &SIN_TO_HALF_PI;
    let z = y * y;
    let z_low = y.fused(y, -z);
    let square = z * z;
    // The first term is large near π/2 and is added with its rounding error.
    let first = z * y.like(c[0]);
    let first_low = z_low.fused(y.like(c[0]), z.fused(y.like(c[0]), -first));
    let second = square.fused(z.fused(y.like(c[3]), y.like(c[2])), z * y.like(c[1]));
    let third = z.fused(y.like(c[5]), y.like(c[4]));
    let last = z.fused(y.like(c[7]), y.like(c[6]));
    let rest = (square * square).fused(square.fused(last, third), second);
    y.fused(first + z.fused(rest, first_low), y)
}

/// y = x − n π/2, its rounding error, and n in the last bits of a number.
#[inline(always)]
fn remainder<R: Turn>(x: R) -> (R, R, R) {
    // Written without closures, which would be compiled for the instruction set of the crate and not for that of the
    // caller.
    let shifted = x.fused(x.like(TWO_OVER_PI), x.like(ROUNDER));
    let n = shifted - x.like(ROUNDER);
    if cfg!(feature = "simd") {
        // Exact: a multiple of 2⁻⁵³ below one.
        let first = n.fused(x.like(-0.5 * PI_1), x);
        let part = n * x.like(0.5 * PI_2);
        let y = first - part;
        let lost = (first - y) - part;
        let rounding = n.fused(x.like(0.5 * PI_2), -part);
        return (y, n.fused(x.like(-0.5 * PI_3), lost - rounding), shifted);
    }
    let first = n.fused(x.like(-PART_1), x);
    let part = n * x.like(PART_2);
    let second = first - part;
    let lost_2 = (first - second) - part;
    let part = n * x.like(PART_3);
    let third = second - part;
    let lost_3 = (second - third) - part;
    let rest = n.fused(x.like(PART_4), -(lost_2 + lost_3));
    let y = third - rest;
    (y, (third - y) - rest, shifted)
}

/// sin x and cos x for |x| ≤ [`LIMIT`].
#[inline(always)]
pub(crate) fn reduced<R: Turn>(x: R) -> (R, R) {
    let (y, low, shifted) = remainder(x);

    // The polynomials are evaluated by Estrin's scheme, so that the chains of dependent operations are short.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::double_double::DoubleDouble;
    use crate::lanes::Lanes;

    /// sin (x + quarters π/2) by a series in double-double arithmetic.
    fn exact(x: f64, quarters: f64) -> DoubleDouble {
        let n = (x * core::f64::consts::FRAC_1_PI + 0.5 * quarters).round();
        let halves = DoubleDouble::new(n - 0.5 * quarters);
        let mut y = DoubleDouble::new(x);
        for part in [PI_1, PI_2, PI_3] {
            y = y.minus(halves.times(DoubleDouble::new(part)));
        }
        let (mut term, mut sum) = (y, y);
        for k in (2..32).step_by(2) {
            let divisor = DoubleDouble::integer(k * (k + 1));
            term = term.times(y).times(y).over(divisor).negated();
            sum = sum.plus(term);
        }
        if n % 2.0 == 0.0 { sum } else { sum.negated() }
    }

    /// Units in the last place by which a result is off.
    fn units(result: f64, exact: DoubleDouble) -> f64 {
        let size = exact.high.abs();
        ((result - exact.high) - exact.low).abs() / (size.next_up() - size)
    }

    #[test]
    fn one_of_both_is_good_to_less_than_one_and_a_half_units() {
        let mut worst = 0.0_f64;
        let mut check = |x: f64| {
            let lanes = Lanes([x, -x, 0.5 * x, 1e-3 * x]);
            let (sin, cos) = (Real::sin(lanes), Real::cos(lanes));
            for lane in 0..4 {
                for (found, quarters) in [(sin.0[lane], 0.0), (cos.0[lane], 1.0)] {
                    let off = units(found, exact(lanes.0[lane], quarters));
                    assert!(off.is_finite(), "{}: {found}", lanes.0[lane]);
                    worst = worst.max(off);
                }
            }
        };
        for k in 0..10_000 {
            check(f64::from(k) * 9.999_973_1);
            check(1e-4 + f64::from(k) * 3.141_618_033_988e-4);
        }
        // Zeros of both, where all digits of the argument cancel.
        for k in 1..10_000 {
            let zero = f64::from(k) * core::f64::consts::FRAC_PI_2;
            check(zero);
            check(zero.next_up());
        }
        assert!(worst < 1.5, "{worst} units in the last place");
        println!("{worst} units in the last place");
    }
}
