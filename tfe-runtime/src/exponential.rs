//! Exponential, logarithm, hyperbolic tangent and power of several numbers at once, without branches; the digits are
//! the same on every processor.
//!
//! ```text
//! exp:    x = n ln 2 + r ,  |r| ≤ ½ ln 2 ,      eˣ = 2ⁿ (1 + r + r² Q(r))
//! tanh:   t = e^(−2|x|) − 1 = 2ⁿ (r + r² Q(r)) + (2ⁿ − 1) ,      tanh |x| = −t/(t + 2)
//! ln:     x = 2ᵏ m ,  ½√2 ≤ m < √2 ,      ln x = k ln 2 + ln m ,      s = (m − 1)/(m + 1) ,      ln m = 2 artanh s
//! power:  xʸ = e^(y ln x), the exponent to twice the precision
//! ```
//!
//! Q is Taylor's series up to r¹³/13!. ln 2 is taken in two parts, the first of 33 bits, so that n times it is exact,
//! fused or not. The polynomial of the logarithm, and how its parts are put together, are those of fdlibm (K. C. Ng). A
//! power multiplies what rounding takes from its logarithm, so that is computed with it, by fused operations; without
//! the feature `simd`, where there are none, powers are left to the functions of the system. Arguments outside the
//! limits below are rare and go to the functions of the system, lane by lane.
//!
//! Judged in double-double arithmetic, the exponential is off by less than one unit in the last place, the logarithm by
//! less than one, the tangent by less than three, the power by less than 1.2. A single number is left to the functions
//! of the system.

use crate::real::Real;
use crate::trigonometry::{Turn, replace_outside, replace_outside_of_two};

/// For |x| up to this limit, eˣ is neither infinite nor subnormal.
pub(crate) const EXP_LIMIT: f64 = 700.0;

/// The range of numbers whose logarithm is computed here.
pub(crate) const LN_LIMITS: (f64, f64) = (f64::MIN_POSITIVE, f64::MAX);

/// Every finite number is within this limit.
pub(crate) const TANH_LIMIT: f64 = f64::MAX;

/// Adding this constant rounds a number to an integer, which the last bits of the sum then contain.
const ROUNDER: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²

/// The parts of ln 2.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// 1/2!, 1/3!, …, 1/13!
const TAYLOR: [[f64; 4]; 3] = [
    [0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0],
    [1.0 / 720.0, 1.0 / 5040.0, 1.0 / 40320.0, 1.0 / 362_880.0],
    [
        1.0 / 3_628_800.0,
        1.0 / 39_916_800.0,
        1.0 / 479_001_600.0,
        1.0 / 6_227_020_800.0,
    ],
];

/// (ln m − 2s)/s in powers of s².
const LN: [f64; 7] = [
    0.666_666_666_666_673_5,
    0.399_999_999_994_094_2,
    0.285_714_287_436_623_9,
    0.222_221_984_321_497_84,
    0.181_835_721_616_180_5,
    0.153_138_376_992_093_73,
    0.147_981_986_051_165_86,
];

/// Numbers whose binary exponents can be read and changed.
pub(crate) trait Scale: Turn {
    /// x 2ⁿ, with n in the last bits of `count`; the result has to be a normal number.
    fn times_power_of_two(self, count: Self) -> Self;

    /// m and k of x = m 2ᵏ with ½√2 ≤ m < √2, for positive normal x.
    fn parted(self) -> (Self, Self);
}

/// The bits of ½√2, rounded.
pub(crate) const HALF_ROOT: u64 = 0x3fe6_a09e_667f_3bcd;
/// The difference between the bits of 1 and of ½√2: added to the bits of a number, it makes the exponent field that of
/// k.
pub(crate) const TO_ONE: u64 = 0x3ff0_0000_0000_0000 - HALF_ROOT;
/// The mantissa bits of a number.
pub(crate) const FRACTION: u64 = 0x000f_ffff_ffff_ffff;
/// 2⁵²: the last bits of its sum with an integer are those of the integer. `BIAS` is the bias of exponents.
pub(crate) const SHIFTED: f64 = 4_503_599_627_370_496.0;
pub(crate) const BIAS: f64 = 1023.0;

impl Scale for f64 {
    #[inline(always)]
    fn times_power_of_two(self, count: Self) -> Self {
        Self::from_bits(self.to_bits().wrapping_add(count.to_bits() << 52))
    }

    #[inline(always)]
    fn parted(self) -> (Self, Self) {
        let bits = self.to_bits().wrapping_add(TO_ONE);
        let part = Self::from_bits((bits & FRACTION).wrapping_add(HALF_ROOT));
        let exponent = Self::from_bits((bits >> 52) | SHIFTED.to_bits());
        (part, exponent - (SHIFTED + BIAS))
    }
}

/// n in the last bits of a number, r = x − n ln 2, and e^r − 1, for |x| ≤ [`EXP_LIMIT`]; `x_low` is the rounding error
/// of x.
#[inline(always)]
fn reduced<R: Scale>(x: R, x_low: Option<R>) -> (R, R) {
    let shifted = x.fused(x.like(core::f64::consts::LOG2_E), x.like(ROUNDER));
    let n = shifted - x.like(ROUNDER);
    let high = n.fused(x.like(-LN_2_HIGH), x);
    let part = n * x.like(LN_2_LOW);
    let r = high - part;
    let low = (high - r) - part;
    // The polynomial is evaluated by Estrin's scheme, so that the chains of dependent operations are short.
    let z = r * r;
    let square = z * z;
    let [first, second, third] = &TAYLOR;
    let upper = square.fused(cubic(r, z, third), cubic(r, z, second));
    let series = square.fused(upper, cubic(r, z, first));
    let mut rest = z.fused(series, low);
    if let Some(x_low) = x_low {
        // The rounding error of a number near 700 is so large that its product with e^r counts.
        rest = x_low.fused(x.like(1.0) + (r + rest), rest);
    }
    (shifted, r + rest)
}

/// c₀ + c₁ x + x² (c₂ + c₃ x)
#[inline(always)]
fn cubic<R: Turn>(x: R, square: R, c: &[f64; 4]) -> R {
    let upper = x.fused(x.like(c[3]), x.like(c[2]));
    square.fused(upper, x.fused(x.like(c[1]), x.like(c[0])))
}

/// eˣ for |x| ≤ [`EXP_LIMIT`].
#[inline(always)]
pub(crate) fn exp_of_small<R: Scale>(x: R) -> R {
    exp_of_two(x, None)
}

/// The same for a number with its rounding error.
#[inline(always)]
fn exp_of_two<R: Scale>(x: R, x_low: Option<R>) -> R {
    let (shifted, less_one) = reduced(x, x_low);
    (x.like(1.0) + less_one).times_power_of_two(shifted)
}

/// tanh x of finite numbers; the sign of a zero is lost.
#[inline(always)]
pub(crate) fn tanh_of_finite<R: Scale>(x: R) -> R {
    /// Beyond this argument, the hyperbolic tangent rounds to one.
    const FAR: f64 = -80.0;

    let (zero, one) = (x.like(0.0), x.like(1.0));
    let is_negative = x.less(zero);
    let size = R::select(is_negative, -x, x);
    let twice = -(size + size);
    let twice = R::select(twice.less(x.like(FAR)), x.like(FAR), twice);
    let (shifted, less_one) = reduced(twice, None);
    let power = one.times_power_of_two(shifted);
    let less_one = less_one.fused(power, power - one);
    let tangent = -(less_one / (less_one + x.like(2.0)));
    R::select(is_negative, -tangent, tangent)
}

/// ln x of positive normal numbers.
#[inline(always)]
pub(crate) fn ln_of_normal<R: Scale>(x: R) -> R {
    let (part, exponent) = x.parted();
    let f = part - x.like(1.0);
    let half = x.like(0.5) * (f * f);
    let s = f / (x.like(2.0) + f);
    let z = s * s;
    let w = z * z;
    let c = &LN;
    let even = w.fused(
        w.fused(w.fused(x.like(c[6]), x.like(c[4])), x.like(c[2])),
        x.like(c[0]),
    );
    let odd = w * w.fused(w.fused(x.like(c[5]), x.like(c[3])), x.like(c[1]));
    let series = z.fused(even, odd);
    let small = s.fused(half + series, exponent * x.like(LN_2_LOW));
    exponent.fused(x.like(LN_2_HIGH), f - (half - small))
}

/// (artanh s − s)/s³ beyond the first term, in powers of s²: 1/5, 1/7, …
const ARTANH: [[f64; 4]; 2] = [
    [1.0 / 5.0, 1.0 / 7.0, 1.0 / 9.0, 1.0 / 11.0],
    [1.0 / 13.0, 1.0 / 15.0, 1.0 / 17.0, 1.0 / 19.0],
];
const ARTANH_END: [f64; 3] = [1.0 / 21.0, 1.0 / 23.0, 1.0 / 25.0];

const THIRD: f64 = 1.0 / 3.0;
const THIRD_LOW: f64 = 1.850_371_707_708_594e-17;

/// ln x of positive normal numbers and its rounding error; together they are accurate to 2⁻⁶⁵ of the logarithm.
#[inline(always)]
fn ln_in_two<R: Scale>(x: R) -> (R, R) {
    let (part, exponent) = x.parted();
    let two = x.like(2.0);
    // s = f/(2 + f) as a sum of two numbers
    let f = part - x.like(1.0);
    let sum = two + f;
    let sum_low = f - (sum - two);
    let inverse = x.like(1.0) / sum;
    let s = f * inverse;
    let s_low = s.fused(-sum_low, s.fused(-sum, f)) * inverse;
    // artanh s = s + s (z/3 + z² (1/5 + …)), z = s²: the first term is a sum of two numbers as well.
    let z = s * s;
    let z_low = (s + s).fused(s_low, s.fused(s, -z));
    let third = x.like(THIRD);
    let first = z * third;
    let first_low = z.fused(third, -first) + z.fused(x.like(THIRD_LOW), z_low * third);
    let w = z * z;
    let square = w * w;
    let ([lower, upper], c) = (&ARTANH, &ARTANH_END);
    let last = w.fused(x.like(c[2]), z.fused(x.like(c[1]), x.like(c[0])));
    let upper = square.fused(last, cubic(z, w, upper));
    let rest = w * square.fused(upper, cubic(z, w, lower));
    let series = first + rest;
    let series_low = ((first - series) + rest) + first_low;
    let (s, s_low) = (s + s, s_low + s_low);
    let product = s * series;
    let product_low = s.fused(series, -product) + s.fused(series_low, s_low * series);
    let high = s + product;
    let low = ((s - high) + product) + (product_low + s_low);
    // k ln 2; its first part is exact, and either zero or the larger one.
    let whole = exponent * x.like(LN_2_HIGH);
    let total = whole + high;
    let moved = total - whole;
    let lost = (whole - (total - moved)) + (high - moved);
    let low = lost + exponent.fused(x.like(LN_2_LOW), low);
    let ln = total + low;
    (ln, (total - ln) + low)
}

/// xʸ of positive normal x, and y ln x, for |y ln x| ≤ [`EXP_LIMIT`].
#[inline(always)]
pub(crate) fn power_of_ordinary<R: Scale>(x: R, y: R) -> (R, R) {
    let (ln, ln_low) = ln_in_two(x);
    let exponent = y * ln;
    let exponent_low = y.fused(ln_low, y.fused(ln, -exponent));
    (exp_of_two(exponent, Some(exponent_low)), exponent)
}

/// A function of W numbers; arguments outside the limits are left to another function.
#[inline(always)]
fn within<const W: usize>(
    x: &[f64; W],
    (low, high): (f64, f64),
    function: impl Fn(f64) -> f64,
    of_others: impl Fn(f64) -> f64,
) -> [f64; W] {
    let (mut values, mut all) = ([0.0; W], true);
    for lane in 0..W {
        values[lane] = function(x[lane]);
        all &= (low <= x[lane]) & (x[lane] <= high);
    }
    if !all {
        replace_outside(x, &mut values, (low, high), of_others);
    }
    values
}

/// eˣ of W numbers.
#[inline]
pub(crate) fn exp<const W: usize>(x: &[f64; W]) -> [f64; W] {
    let limits = (-EXP_LIMIT, EXP_LIMIT);
    within(x, limits, exp_of_small, Real::exp)
}

/// tanh x of W numbers.
#[inline]
pub(crate) fn tanh<const W: usize>(x: &[f64; W]) -> [f64; W] {
    let limits = (-TANH_LIMIT, TANH_LIMIT);
    within(x, limits, tanh_of_finite, Real::tanh)
}

/// ln x of W numbers.
#[inline]
pub(crate) fn ln<const W: usize>(x: &[f64; W]) -> [f64; W] {
    within(x, LN_LIMITS, ln_of_normal, Real::ln)
}

/// xʸ of W numbers.
#[inline]
pub(crate) fn powf<const W: usize>(x: &[f64; W], y: &[f64; W]) -> [f64; W] {
    let (mut powers, mut exponents) = ([0.0; W], [0.0; W]);
    if cfg!(not(feature = "simd")) {
        for lane in 0..W {
            powers[lane] = Real::powf(x[lane], y[lane]);
        }
        return powers;
    }
    for lane in 0..W {
        (powers[lane], exponents[lane]) = power_of_ordinary(x[lane], y[lane]);
    }
    let limits = [(x, LN_LIMITS), (&exponents, (-EXP_LIMIT, EXP_LIMIT))];
    replace_outside_of_two(limits, (x, y), &mut powers, Real::powf);
    powers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::double_double::DoubleDouble;
    use crate::lanes::Lanes;

    /// ln 2 in three parts.
    const LN_2: [f64; 3] = [
        core::f64::consts::LN_2,
        2.319_046_813_846_299_6e-17,
        5.707_708_438_416_212e-34,
    ];

    /// n and e^r − 1 of x = n ln 2 + r, by a series in double-double arithmetic.
    fn exact_parts(x: f64) -> (f64, DoubleDouble) {
        let n = (x * core::f64::consts::LOG2_E).round();
        let mut r = DoubleDouble::new(x);
        for part in LN_2 {
            r = r.minus(DoubleDouble::product(n, part));
        }
        let (mut term, mut sum) = (r, r);
        for k in 2..30 {
            term = term.times(r).over(DoubleDouble::integer(k));
            sum = sum.plus(term);
        }
        (n, sum)
    }

    fn exact_exp(x: f64) -> DoubleDouble {
        let (n, less_one) = exact_parts(x);
        // Each part by itself, which is exact: a product would split the power, and that overflows above e^690.
        let power = 2.0_f64.powi(n as i32);
        let DoubleDouble { high, low } = less_one.plus(DoubleDouble::ONE);
        DoubleDouble {
            high: power * high,
            low: power * low,
        }
    }

    fn exact_tanh(x: f64) -> DoubleDouble {
        let (n, less_one) = exact_parts(-2.0 * x);
        let power = DoubleDouble::new(2.0_f64.powi(n as i32));
        let less_one = less_one.times(power).plus(power.minus(DoubleDouble::ONE));
        less_one
            .over(less_one.plus(DoubleDouble::new(2.0)))
            .negated()
    }

    /// By Newton's method from the logarithm of the system.
    fn exact_ln(x: f64) -> DoubleDouble {
        let first = f64::ln(x);
        let quotient = DoubleDouble::new(x).over(exact_exp(first));
        let d = quotient.minus(DoubleDouble::ONE);
        // ln (1 + d), d some 1e-16
        let correction = d.minus(d.times(d).half());
        DoubleDouble::new(first).plus(correction)
    }

    /// Units in the last place by which a result is off.
    fn units(result: f64, exact: DoubleDouble) -> f64 {
        let size = exact.high.abs();
        ((result - exact.high) - exact.low).abs() / (size.next_up() - size)
    }

    /// The worst at many numbers, and at some fractions of each.
    fn worst(
        numbers: impl Iterator<Item = f64>,
        function: impl Fn(Lanes<4>) -> Lanes<4>,
        exact: impl Fn(f64) -> DoubleDouble,
    ) -> f64 {
        let mut worst = 0.0_f64;
        for x in numbers {
            let lanes = Lanes([x, 0.77 * x, 0.5 * x, 1e-3 * x]);
            let values = function(lanes);
            for lane in 0..4 {
                let off = units(values.0[lane], exact(lanes.0[lane]));
                assert!(off.is_finite(), "{}: {}", lanes.0[lane], values.0[lane]);
                worst = worst.max(off);
            }
        }
        println!("{worst} units in the last place");
        worst
    }

    #[test]
    fn exponentials_are_good_to_a_unit() {
        let numbers = (0..40_000).map(|k| f64::from(k - 20_000) * 0.034_999_1);
        assert!(worst(numbers, Real::exp, exact_exp) < 1.0);
    }

    #[test]
    fn tangents_are_good_to_three_units() {
        let far = (1..20_000).map(|k| f64::from(k) * 2.13e-3);
        let near = (1..20_000).map(|k| f64::from(k) * -3.1e-5);
        let tiny = (1..300).map(|k| 0.3 * 10.0_f64.powi(-k));
        let numbers = far.chain(near).chain(tiny);
        assert!(worst(numbers, Real::tanh, exact_tanh) < 3.0);
    }

    #[test]
    fn logarithms_are_good_to_a_unit() {
        // Near one, where all digits cancel, at the ends of the parts, and far away.
        let near = (1..20_000).map(|k| 1.0 + f64::from(k) * 3.7e-5);
        let next = (0..50).flat_map(|k| {
            let one = 1.0_f64.to_bits();
            [
                f64::from_bits(one + (1 << k)),
                f64::from_bits(one - (1 << k)),
            ]
        });
        let ends =
            (1..2000).map(|k| core::f64::consts::SQRT_2 * (1.0 + f64::from(k - 1000) * 1e-9));
        let far = (0..600).map(|k| 1.7 * 10.0_f64.powi(k - 300));
        let numbers = near.chain(next).chain(ends).chain(far);
        let numbers = numbers.filter(|x| *x != 1.0);
        assert!(worst(numbers, Real::ln, exact_ln) < 1.0);
    }

    /// eˣ of a number to twice the precision.
    fn exact_exp_of(x: DoubleDouble) -> DoubleDouble {
        let low = DoubleDouble::new(x.low);
        // e^low, low some 1e-16 of x
        let factor = low.plus(low.times(low).half()).plus(DoubleDouble::ONE);
        exact_exp(x.high).times(factor)
    }

    #[test]
    #[cfg(feature = "simd")]
    fn powers_are_good_to_a_unit() {
        // Moderate ones, such as models have; bases of all sizes; bases near one with large exponents, where the
        // logarithm is multiplied most.
        let exponents = [0.5, -1.5, 2.5, 1.0 / 3.0, 3.0, -0.1, 7.3, 40.7];
        let moderate = (1..20_000).map(|k| (f64::from(k) * 3.7e-4, exponents[k as usize % 8]));
        let sizes = (-300..300).map(|k| (1.3 * 10.0_f64.powi(k), f64::from(k % 7) * 0.17 - 0.4));
        let near_one = (1..20_000).map(|k| {
            let base = 1.0 + f64::from(k - 10_000) * 3.1e-5;
            (base, 640.0 / base.ln().clamp(-1e9, 1e9))
        });
        let next = (0..40).map(|k| (f64::from_bits(1.0_f64.to_bits() + (1 << k)), 1e9));
        let all = moderate.chain(sizes).chain(near_one).chain(next);
        let mut worst = 0.0_f64;
        for (x, y) in all.filter(|(x, y)| *x != 1.0 && (y * x.ln()).abs() < 650.0) {
            let exact = exact_exp_of(exact_ln(x).times(DoubleDouble::new(y)));
            let power = Real::powf(Lanes([x, 2.0]), Lanes([y, 3.0])).0;
            let off = units(power[0], exact);
            assert!(off.is_finite() && power[1] == 8.0, "{x}, {y}: {power:?}");
            worst = worst.max(off);
        }
        println!("{worst} units in the last place");
        assert!(worst < 1.2, "{worst}");
    }

    #[test]
    fn extraordinary_powers_are_those_of_numbers() {
        let given = [
            0.0,
            -0.0,
            1.0,
            -2.0,
            5e-324,
            1e-310,
            f64::MAX,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
            0.5,
            3.0,
            -1e9,
        ];
        for x in given {
            for y in given {
                let found = Real::powf(Lanes([x, 1.0]), Lanes([y, 0.3])).0;
                let expected = f64::powf(x, y);
                let near = (found[0] - expected).abs() <= 2.0 * f64::EPSILON * expected.abs();
                let is_same = found[0] == expected || (found[0].is_nan() && expected.is_nan());
                assert!(near || is_same, "{x}, {y}: {}, {expected}", found[0]);
                assert_eq!(found[1], 1.0);
            }
        }
    }

    #[test]
    fn what_is_extraordinary_is_that_of_numbers() {
        let given = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            -0.0,
            -1.0,
            5e-324,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            709.0,
            -745.0,
            800.0,
            1.0,
        ];
        let same = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan());
        for x in given {
            let lanes = Lanes([x, 0.5, 1.0, 2.0]);
            for (found, expected) in [
                (Real::exp(lanes).0[0], f64::exp(x)),
                (Real::tanh(lanes).0[0], f64::tanh(x)),
                (Real::ln(lanes).0[0], f64::ln(x)),
            ] {
                let near = (found - expected).abs() <= 4.0 * f64::EPSILON * expected.abs();
                assert!(same(found, expected) || near, "{x}: {found}, {expected}");
            }
        }
        assert_eq!(Real::exp(Lanes([0.0; 4])).0, [1.0; 4]);
        assert_eq!(Real::ln(Lanes([1.0; 4])).0, [0.0; 4]);
        assert_eq!(Real::tanh(Lanes([0.0; 4])).0, [0.0; 4]);
    }
}
