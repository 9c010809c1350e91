//! Constants known during the derivation: exact rationals while they fit, otherwise `f64`.
//!
//! `1/2` is one half and `1e-3` is one thousandth until a program is scheduled; only then is each constant rounded,
//! once.

use std::fmt;
use std::ops::{Add, Mul, Neg, Sub};

/// A number, compared exactly (floating numbers by their bits).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Constant(Representation);

/// Rationals are in lowest terms with a positive denominator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Representation {
    Rational { numerator: i128, denominator: i128 },
    Float(u64),
}

/// Integers up to this size are exact in `f64`.
const EXACT: i128 = 1 << 53;

impl Constant {
    /// 0
    pub const ZERO: Self = Self::whole(0);
    /// 1
    pub const ONE: Self = Self::whole(1);
    /// −1
    pub const MINUS_ONE: Self = Self::whole(-1);

    const fn whole(value: i128) -> Self {
        Self(Representation::Rational {
            numerator: value,
            denominator: 1,
        })
    }

    /// An integer.
    pub const fn integer(value: i64) -> Self {
        Self::whole(value as i128)
    }

    /// `numerator / denominator`, or `None` if the denominator is zero or the reduced fraction does not fit.
    pub fn rational(numerator: i128, denominator: i128) -> Option<Self> {
        if denominator == 0 {
            return None;
        }
        if denominator == 1 && numerator != i128::MIN {
            return Some(Self::whole(numerator));
        }
        let common = gcd(numerator.unsigned_abs(), denominator.unsigned_abs());
        let top = i128::try_from(numerator.unsigned_abs() / common).ok()?;
        let bottom = i128::try_from(denominator.unsigned_abs() / common).ok()?;
        let negative = (numerator < 0) != (denominator < 0);
        let numerator = if negative { -top } else { top };
        Some(Self(Representation::Rational {
            numerator,
            denominator: bottom,
        }))
    }

    /// A floating number; integers below 2⁵³ become exact.
    pub fn float(value: f64) -> Self {
        if value.fract() == 0.0 && value.abs() <= EXACT as f64 {
            Self::whole(value as i128)
        } else {
            Self(Representation::Float(value.to_bits()))
        }
    }

    /// Reads a decimal literal (`12`, `0.5`, `1e-3`) exactly where it fits, else as the nearest `f64`.
    ///
    /// `None` if it is no such literal, or too large for an `f64`.
    pub fn parse(text: &str) -> Option<Self> {
        let nearest: f64 = text.parse().ok().filter(|value: &f64| value.is_finite())?;
        if !text
            .bytes()
            .all(|byte| matches!(byte, b'0'..=b'9' | b'.' | b'e' | b'E' | b'+' | b'-'))
        {
            return None;
        }
        Some(exact_decimal(text).unwrap_or_else(|| Self::float(nearest)))
    }

    /// The nearest `f64`.
    pub fn to_f64(self) -> f64 {
        match self.0 {
            Representation::Float(bits) => f64::from_bits(bits),
            Representation::Rational {
                numerator,
                denominator,
            } => {
                if numerator.abs() <= EXACT && denominator <= EXACT {
                    // Both are exact, so that only the division rounds.
                    numerator as f64 / denominator as f64
                } else {
                    let size = quotient(numerator.unsigned_abs(), denominator.unsigned_abs());
                    if numerator < 0 { -size } else { size }
                }
            }
        }
    }

    /// Its value where it is an integer.
    pub fn as_integer(self) -> Option<i64> {
        match self.0 {
            Representation::Rational {
                numerator,
                denominator: 1,
            } => i64::try_from(numerator).ok(),
            _ => None,
        }
    }

    /// Numerator and denominator where it is exact.
    pub fn as_ratio(self) -> Option<(i128, i128)> {
        match self.0 {
            Representation::Rational {
                numerator,
                denominator,
            } => Some((numerator, denominator)),
            Representation::Float(_) => None,
        }
    }

    /// Whether it is 0.
    pub fn is_zero(self) -> bool {
        self == Self::ZERO
    }

    /// Whether it is 1.
    pub fn is_one(self) -> bool {
        self == Self::ONE
    }

    /// Whether it is a power of two or the negative of one, so that products with it are exact.
    pub(crate) fn is_power_of_two(self) -> bool {
        const FRACTION: u64 = (1 << 52) - 1;
        match self.as_ratio() {
            Some((top, bottom)) => {
                top.unsigned_abs().is_power_of_two() && bottom.unsigned_abs().is_power_of_two()
            }
            None => {
                let value = self.to_f64();
                value.is_normal() && value.to_bits() & FRACTION == 0
            }
        }
    }

    /// Whether it is below 0.
    pub fn is_negative(self) -> bool {
        match self.0 {
            Representation::Rational { numerator, .. } => numerator < 0,
            Representation::Float(bits) => f64::from_bits(bits) < 0.0,
        }
    }

    /// Its size.
    pub fn abs(self) -> Self {
        if self.is_negative() { -self } else { self }
    }

    /// 1 over it, `None` for 0.
    pub fn reciprocal(self) -> Option<Self> {
        match self.0 {
            Representation::Rational {
                numerator,
                denominator,
            } => Self::rational(denominator, numerator),
            Representation::Float(bits) => Some(Self::float(1.0 / f64::from_bits(bits))),
        }
    }

    /// The power with an integer exponent; `None` for 0 to a negative one.
    pub fn powi(self, exponent: i32) -> Option<Self> {
        if exponent < 0 {
            return self.reciprocal()?.powi(exponent.checked_neg()?);
        }
        if self.as_ratio().is_none() {
            return Some(Self::float(self.to_f64().powi(exponent)));
        }
        let (mut result, mut square, mut rest) = (Self::ONE, self, exponent);
        while rest > 0 {
            if rest & 1 == 1 {
                result = result * square;
            }
            rest >>= 1;
            if rest > 0 {
                square = square * square;
            }
        }
        if result.as_ratio().is_none() {
            // Left the exact numbers on the way: round once instead.
            return Some(Self::float(self.to_f64().powi(exponent)));
        }
        Some(result)
    }

    /// Whether an `f64` holds it with all digits: no zero, not subnormal, finite.
    fn is_normal(self) -> bool {
        // Fractions of 127-bit integers lie far inside the range of f64.
        !self.is_zero() && (self.as_ratio().is_some() || self.to_f64().is_normal())
    }

    /// The product, unless it leaves the normal numbers, of which both are.
    pub(crate) fn product_in_range(self, other: Self) -> Option<Self> {
        let product = self * other;
        let is_lost = !product.is_normal() && self.is_normal() && other.is_normal();
        (!is_lost).then_some(product)
    }

    /// The power with an integer exponent, unless it leaves the normal numbers, of which this is one; `None` for 0 to a negative one, too.
    pub(crate) fn powi_in_range(self, exponent: i32) -> Option<Self> {
        let power = self.powi(exponent)?;
        let is_lost = !power.is_normal() && self.is_normal();
        (!is_lost).then_some(power)
    }

    /// The square root where it is exact.
    pub fn exact_sqrt(self) -> Option<Self> {
        let (numerator, denominator) = self.as_ratio()?;
        let root = |value: i128| {
            let root = u128::try_from(value).ok()?.isqrt();
            let root = i128::try_from(root).ok()?;
            (root * root == value).then_some(root)
        };
        Self::rational(root(numerator)?, root(denominator)?)
    }

    /// Applies an exact operation, or the same one on `f64` where the exact result does not fit.
    fn combine(
        self,
        other: Self,
        exact: impl Fn((i128, i128), (i128, i128)) -> Option<Self>,
        rounded: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let both = self.as_ratio().zip(other.as_ratio());
        both.and_then(|(a, b)| exact(a, b))
            .unwrap_or_else(|| Self::float(rounded(self.to_f64(), other.to_f64())))
    }
}

impl Add for Constant {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.combine(
            other,
            |(a, b), (c, d)| {
                Self::rational(
                    a.checked_mul(d)?.checked_add(c.checked_mul(b)?)?,
                    b.checked_mul(d)?,
                )
            },
            |a, b| a + b,
        )
    }
}

impl Sub for Constant {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Constant {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::ZERO;
        }
        self.combine(
            other,
            |(a, b), (c, d)| {
                // Crosswise reduction keeps the products small.
                let (left, right) = (
                    Self::rational(a, d)?.as_ratio()?,
                    Self::rational(c, b)?.as_ratio()?,
                );
                Self::rational(left.0.checked_mul(right.0)?, left.1.checked_mul(right.1)?)
            },
            |a, b| a * b,
        )
    }
}

impl Neg for Constant {
    type Output = Self;

    fn neg(self) -> Self {
        match self.0 {
            // Never overflows: `rational` keeps numerators above i128::MIN.
            Representation::Rational {
                numerator,
                denominator,
            } => Self(Representation::Rational {
                numerator: -numerator,
                denominator,
            }),
            Representation::Float(bits) => Self::float(-f64::from_bits(bits)),
        }
    }
}

impl fmt::Display for Constant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Representation::Rational {
                numerator,
                denominator: 1,
            } => write!(f, "{numerator}"),
            Representation::Rational {
                numerator,
                denominator,
            } => {
                if is_decimal(denominator) && numerator.abs() <= EXACT && denominator <= EXACT {
                    write!(f, "{}", self.to_f64())
                } else {
                    write!(f, "{numerator}/{denominator}")
                }
            }
            Representation::Float(bits) => write!(f, "{:?}", f64::from_bits(bits)),
        }
    }
}

/// Whether 1/denominator is a finite decimal.
pub(crate) fn is_decimal(mut denominator: i128) -> bool {
    for prime in [2, 5] {
        while denominator % prime == 0 {
            denominator /= prime;
        }
    }
    denominator == 1
}

fn gcd(mut a: u128, mut b: u128) -> u128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a.max(1)
}

/// a / b rounded once to the nearest `f64`, ties to even, by binary long division.
fn quotient(a: u128, b: u128) -> f64 {
    if a == 0 {
        return 0.0;
    }
    let mut whole = a / b;
    let mut rest = a % b;
    let mut exponent = 0;
    // 64 significant bits, the last one sticky: the conversion below then rounds correctly.
    while whole < 1 << 64 {
        // rest < b ≤ i128::MAX, so doubling fits.
        rest *= 2;
        whole = whole * 2 + u128::from(rest >= b);
        if rest >= b {
            rest -= b;
        }
        exponent -= 1;
    }
    if rest != 0 {
        whole |= 1;
    }
    // Fractions of 127-bit integers lie far inside the range of f64, so this scaling is exact.
    whole as f64 * 2f64.powi(exponent)
}

fn exact_decimal(text: &str) -> Option<Constant> {
    let (digits, exponent) = match text.split_once(['e', 'E']) {
        Some((digits, exponent)) => (digits, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let numerator: i128 = format!("{whole}{fraction}").parse().ok()?;
    let exponent = exponent.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let scale = 10i128.checked_pow(exponent.unsigned_abs())?;
    if exponent < 0 {
        Constant::rational(numerator, scale)
    } else {
        Some(Constant::whole(numerator.checked_mul(scale)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(numerator: i128, denominator: i128) -> Constant {
        Constant::rational(numerator, denominator).unwrap()
    }

    #[test]
    fn literals_are_exact() {
        assert_eq!(Constant::parse("1e-3"), Some(ratio(1, 1000)));
        assert_eq!(Constant::parse("0.50"), Some(ratio(1, 2)));
        assert_eq!(Constant::parse("12"), Some(Constant::integer(12)));
        assert_eq!(Constant::parse("2.5E2"), Some(Constant::integer(250)));
        assert_eq!(Constant::parse("3."), Some(Constant::integer(3)));
    }

    #[test]
    fn what_is_no_literal_is_refused() {
        for text in ["", "x", "inf", "nan", "1e400", "--1", "1e"] {
            assert_eq!(Constant::parse(text), None, "{text}");
        }
    }

    #[test]
    fn literals_that_do_not_fit_become_the_nearest_float() {
        let text = "3.14159265358979323846264338327950288419716939937510";
        assert_eq!(
            Constant::parse(text).unwrap().to_f64(),
            std::f64::consts::PI
        );
        assert_eq!(Constant::parse("1e-300").unwrap().to_f64(), 1e-300);
    }

    #[test]
    fn rationals_round_once() {
        for text in [
            "0.1",
            "9.81",
            "13.734",
            "0.12345678901234567890123456789",
            "123456789012345678901.5",
        ] {
            assert_eq!(
                Constant::parse(text).unwrap().to_f64(),
                text.parse::<f64>().unwrap(),
                "{text}"
            );
        }
        assert_eq!(ratio(i128::MAX, 3).to_f64(), i128::MAX as f64 / 3.0);
    }

    #[test]
    fn arithmetic_is_exact_while_it_fits() {
        assert_eq!(ratio(1, 3) + ratio(1, 6), ratio(1, 2));
        assert_eq!(ratio(2, 3) * ratio(3, 4), ratio(1, 2));
        assert_eq!(ratio(1, 3) - ratio(1, 3), Constant::ZERO);
        assert_eq!(ratio(-2, 3).powi(-3), Some(ratio(-27, 8)));
        assert_eq!(ratio(4, 9).exact_sqrt(), Some(ratio(2, 3)));
        assert_eq!(ratio(1, 2).exact_sqrt(), None);
        assert_eq!(Constant::ZERO.powi(-1), None);
        assert_eq!(Constant::ZERO.powi(0), Some(Constant::ONE));
    }

    #[test]
    fn overflow_falls_back_to_floats() {
        let large = Constant::integer(i64::MAX);
        assert_eq!(large.powi_in_range(5), large.powi(5));
        let fifth = large.powi(5).unwrap();
        assert_eq!(fifth.as_ratio(), None);
        assert_eq!(fifth.to_f64(), (i64::MAX as f64).powi(5));
        assert_eq!(Constant::rational(1, i128::MIN), None);
    }

    #[test]
    fn products_out_of_range_are_told() {
        let [small, large] = [1e-200, 1e200].map(Constant::float);
        assert_eq!(small.product_in_range(small), None);
        assert_eq!(large.product_in_range(large), None);
        assert_eq!(small.powi_in_range(2), None);
        assert_eq!(small.powi_in_range(-2), None);
        assert_eq!(Constant::float(1e-160).powi_in_range(2), None, "subnormal");
        assert!(small.product_in_range(large).is_some());
        let zero = Constant::ZERO;
        assert_eq!(small.product_in_range(zero), Some(zero));
        // What is subnormal already has no digits to lose.
        let tiny = Constant::float(1e-310);
        let half = ratio(1, 2);
        assert_eq!(tiny.product_in_range(half), Some(tiny * half));
    }
}
