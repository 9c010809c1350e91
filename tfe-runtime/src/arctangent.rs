//! Arctangents of several numbers at once, without branches; the digits are the same on every processor.
//!
//! ```text
//! u = t, (2t − 1)/(2 + t), (t − 1)/(t + 1)  for  t = min(|x|, |y|)/max(|x|, |y|) up to 7/16, 11/16, 1
//! arctan t = 0, arctan ½, π/4  +  arctan u ,        |u| < 7/16
//! ```
//!
//! The angle is then arctan t, or its difference from π/2 or π, depending on the octant of (x, y). The numerators are
//! exact. The polynomial and the intervals are those of fdlibm (S. Moshier, K. C. Ng). The base (0, arctan ½ or π/4)
//! and the polynomial are added last, together with the rounding error of the base. Lanes in which y is zero, or a
//! number is subnormal, huge, infinite or NaN, are rare and are evaluated one by one by the functions of the system.
//!
//! Compared with double-double arithmetic, the error of the angle is less than 1.5 units in the last place. A single
//! number is left to the functions of the system.

use crate::real::Real;
use crate::trigonometry::{Turn, replace_outside_of_two};

/// The magnitudes of y for which the angle is computed here.
pub(crate) const ORDINARY: (f64, f64) = (f64::MIN_POSITIVE, FAR);

/// The sum of two numbers of this magnitude is finite.
const FAR: f64 = 1e300;

/// The range of x for which the angle is computed here; zero is included.
pub(crate) const FINITE: (f64, f64) = (-FAR, FAR);

const HALF: f64 = 0.463_647_609_000_806_1; // arctan ½
const HALF_LOW: f64 = 2.269_877_745_296_168_7e-17;
const QUARTER: f64 = core::f64::consts::FRAC_PI_4;
const QUARTER_LOW: f64 = 3.061_616_997_868_383e-17;

/// (u − arctan u)/u³ in powers of u².
const SERIES: [f64; 11] = [
    0.333_333_333_333_329_3,
    -0.199_999_999_998_764_83,
    0.142_857_142_725_034_66,
    -0.111_111_104_054_623_56,
    0.090_908_871_334_365_07,
    -0.076_918_762_050_448_3,
    0.066_610_731_373_875_31,
    -0.058_335_701_337_905_735,
    0.049_768_779_946_159_324,
    -0.036_531_572_744_216_916,
    0.016_285_820_115_365_782,
];

/// The angle of the point (x, y), |y| within [`ORDINARY`], x within [`FINITE`].
#[inline(always)]
pub(crate) fn atan2_of_ordinary<R: Turn>(y: R, x: R) -> R {
    let zero = y.like(0.0);
    let (height, width) = (y.abs(), x.abs());
    let is_steep = width.less(height);
    let small = R::select(is_steep, width, height);
    let large = R::select(is_steep, height, width);
    let about_half = (large * y.like(0.4375)).less(small);
    let about_one = (large * y.like(0.6875)).less(small);
    let over = R::select(about_half, (small + small) - large, small);
    let over = R::select(about_one, small - large, over);
    let under = R::select(about_half, (large + large) + small, large);
    let under = R::select(about_one, large + small, under);
    let base = R::select(about_half, y.like(HALF), zero);
    let base = R::select(about_one, y.like(QUARTER), base);
    let low = R::select(about_half, y.like(HALF_LOW), zero);
    let low = R::select(about_one, y.like(QUARTER_LOW), low);
    let u = over / under;
    // The polynomial is evaluated in two halves, so that the chains of dependent operations are short.
    let c = &SERIES;
    let z = u * u;
    let w = z * z;
    let even = w.fused(y.like(c[10]), y.like(c[8]));
    let even = w.fused(even, y.like(c[6]));
    let even = w.fused(even, y.like(c[4]));
    let even = w.fused(w.fused(even, y.like(c[2])), y.like(c[0]));
    let odd = w.fused(y.like(c[9]), y.like(c[7]));
    let odd = w.fused(w.fused(odd, y.like(c[5])), y.like(c[3]));
    let odd = w.fused(odd, y.like(c[1]));
    let series = z.fused(even, w * odd);
    let part = u - u * series;
    // Where |y| is the larger one, the angle is π/2 less the arctangent.
    let (base, low, part) = less_from(
        is_steep,
        (2.0 * QUARTER, 2.0 * QUARTER_LOW),
        (base, low, part),
    );
    let (base, low, part) = less_from(
        x.less(zero),
        (4.0 * QUARTER, 4.0 * QUARTER_LOW),
        (base, low, part),
    );
    let angle = base + (part + low);
    R::select(y.less(zero), -angle, angle)
}

/// `whole` minus a sum of three terms where the mask holds; the first term is no larger than `whole`.
#[inline(always)]
fn less_from<R: Turn>(
    mask: R::Mask,
    (whole, whole_low): (f64, f64),
    (base, low, part): (R, R, R),
) -> (R, R, R) {
    let rest = base.like(whole) - base;
    let lost = (base.like(whole) - rest) - base;
    (
        R::select(mask, rest, base),
        R::select(mask, (base.like(whole_low) - low) + lost, low),
        R::select(mask, -part, part),
    )
}

/// The angles of W points.
#[inline]
pub(crate) fn atan2<const W: usize>(y: &[f64; W], x: &[f64; W]) -> [f64; W] {
    let (mut angles, mut heights) = ([0.0; W], [0.0; W]);
    for lane in 0..W {
        angles[lane] = atan2_of_ordinary(y[lane], x[lane]);
        heights[lane] = y[lane].abs();
    }
    let limits = [(&heights, ORDINARY), (x, FINITE)];
    replace_outside_of_two(limits, (y, x), &mut angles, Real::atan2);
    angles
}

/// Arctangents of W numbers.
#[inline]
pub(crate) fn atan<const W: usize>(x: &[f64; W]) -> [f64; W] {
    atan2(x, &[1.0; W])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::double_double::DoubleDouble;
    use crate::lanes::Lanes;

    /// The angle of a point in double-double arithmetic: one step of Newton's method for sin (a − a₀) = (y cos a₀ − x
    /// sin a₀)/r from the angle of the system, sine and cosine by series.
    fn exact(y: f64, x: f64) -> DoubleDouble {
        let first = f64::atan2(y, x);
        let (sin, cos) = exact_sin_cos(first);
        let across = cos
            .times(DoubleDouble::new(y))
            .minus(sin.times(DoubleDouble::new(x)));
        let along = cos
            .times(DoubleDouble::new(x))
            .plus(sin.times(DoubleDouble::new(y)));
        DoubleDouble::new(first).plus(across.over(along))
    }

    fn exact_sin_cos(x: f64) -> (DoubleDouble, DoubleDouble) {
        let square = DoubleDouble::product(x, x);
        let (mut sin, mut cos) = (DoubleDouble::ZERO, DoubleDouble::ZERO);
        let (mut odd, mut even) = (DoubleDouble::new(x), DoubleDouble::ONE);
        for k in 1..30 {
            (sin, cos) = (sin.plus(odd), cos.plus(even));
            even = even
                .times(square)
                .over(DoubleDouble::integer((2 * k - 1) * 2 * k))
                .negated();
            odd = odd
                .times(square)
                .over(DoubleDouble::integer(2 * k * (2 * k + 1)))
                .negated();
        }
        (sin, cos)
    }

    #[test]
    fn angles_are_good_to_a_unit_and_a_half() {
        let mut worst = 0.0_f64;
        let mut judge = |y: f64, x: f64| {
            let given = [(y, x), (x, y), (-y, x), (y, -x)];
            let found = Real::atan2(Lanes(given.map(|one| one.0)), Lanes(given.map(|one| one.1)));
            for ((y, x), found) in given.into_iter().zip(found.0) {
                let exact = exact(y, x);
                let size = exact.high.abs();
                let off = ((found - exact.high) - exact.low).abs() / (size.next_up() - size);
                assert!(off.is_finite(), "{y}, {x}: {found}");
                worst = worst.max(off);
            }
        };
        for k in 1..40_000 {
            let t = f64::from(k) * 2.5e-5;
            judge(t, 1.0);
            judge(3.7e-5 * t, 2.9e-5);
            judge(1.7e200 * t, 1.3e200 * (2.0 - t));
        }
        // About the ends of the intervals, and far from all of them.
        for k in -200..200 {
            for end in [0.4375, 0.6875, 1.0] {
                judge(end * (1.0 + f64::from(k) * f64::EPSILON), 1.0);
            }
            judge(1.7 * 10.0_f64.powi(k / 2), 1.0);
        }
        println!("{worst} units in the last place");
        assert!(worst < 1.5, "{worst}");
    }

    #[test]
    fn arctangents_are_angles() {
        for x in [0.3, -2.0, 1e-9, 5e20, -0.9] {
            let lanes = Lanes([x, 0.5 * x, 0.0, 1.0]);
            let found = Real::atan(lanes);
            for lane in 0..4 {
                let expected = f64::atan(lanes.0[lane]);
                assert!((found.0[lane] - expected).abs() <= 2.0 * f64::EPSILON * expected.abs());
            }
        }
    }

    #[test]
    fn what_is_extraordinary_is_that_of_numbers() {
        let given = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            5e-324,
            -f64::MIN_POSITIVE,
            f64::MAX,
            f64::MIN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
        ];
        for y in given {
            for x in given {
                let found = Real::atan2(Lanes([y, 1.0]), Lanes([x, 1.0])).0;
                let expected = f64::atan2(y, x);
                let near = (found[0] - expected).abs() <= 2.0 * f64::EPSILON * expected.abs();
                let is_same = found[0] == expected && found[0].signum() == expected.signum();
                assert!(
                    near || is_same || (found[0].is_nan() && expected.is_nan()),
                    "{y}, {x}: {}, {expected}",
                    found[0]
                );
                assert_eq!(found[1], QUARTER);
            }
        }
    }
}
