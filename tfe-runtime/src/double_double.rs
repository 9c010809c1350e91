//! Numbers of twice the working precision, in constant functions.
//!
//! The tables of an element are computed once, with about 31 digits, and rounded once: an error in the last digit of a
//! coefficient would be the same in every step, and would accumulate instead of averaging out. Only the algorithms of
//! Dekker and Knuth are used, without fused multiply-adds, so that evaluation at compile time and at run time gives the
//! same digits.

/// An unevaluated sum high + low with |low| ≤ ulp(high)/2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DoubleDouble {
    pub(crate) high: f64,
    pub(crate) low: f64,
}

impl DoubleDouble {
    pub(crate) const ZERO: Self = Self::new(0.0);
    pub(crate) const ONE: Self = Self::new(1.0);

    pub(crate) const fn new(value: f64) -> Self {
        Self {
            high: value,
            low: 0.0,
        }
    }

    /// A small integer; exact.
    pub(crate) const fn integer(value: usize) -> Self {
        Self::new(value as f64)
    }

    /// a + b exactly, for |a| ≥ |b|.
    const fn ordered_sum(a: f64, b: f64) -> Self {
        let high = a + b;
        Self {
            high,
            low: b - (high - a),
        }
    }

    /// a + b exactly.
    pub(crate) const fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let part = high - a;
        Self {
            high,
            low: (a - (high - part)) + (b - part),
        }
    }

    /// a · b exactly.
    pub(crate) const fn product(a: f64, b: f64) -> Self {
        let product = Self::split_product(a, b);
        if product.low.is_finite() {
            product
        } else {
            Self::large_product(a, b)
        }
    }

    /// The same for numbers beyond 10³⁰⁰, whose splitting overflows: the larger factor is scaled by a power of two.
    #[cold]
    const fn large_product(a: f64, b: f64) -> Self {
        const SCALE: f64 = 18_014_398_509_481_984.0; // 2⁵⁴
        let (large, other) = if a.abs() > b.abs() { (a, b) } else { (b, a) };
        let product = Self::split_product(large / SCALE, other);
        Self {
            high: SCALE * product.high,
            low: SCALE * product.low,
        }
    }

    /// a · b exactly, by splitting both factors into halves of 26 bits; the low part is not finite if that overflows.
    pub(crate) const fn split_product(a: f64, b: f64) -> Self {
        const SPLIT: f64 = 134_217_729.0; // 2²⁷ + 1
        let (at, bt) = (SPLIT * a, SPLIT * b);
        let (ah, bh) = (at - (at - a), bt - (bt - b));
        let (al, bl) = (a - ah, b - bh);
        let high = a * b;
        Self {
            high,
            low: ((ah * bh - high) + ah * bl + al * bh) + al * bl,
        }
    }

    pub(crate) const fn plus(self, other: Self) -> Self {
        let high = Self::sum(self.high, other.high);
        let low = Self::sum(self.low, other.low);
        let first = Self::ordered_sum(high.high, high.low + low.high);
        Self::ordered_sum(first.high, first.low + low.low)
    }

    pub(crate) const fn negated(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }

    pub(crate) const fn minus(self, other: Self) -> Self {
        self.plus(other.negated())
    }

    pub(crate) const fn times(self, other: Self) -> Self {
        let product = Self::product(self.high, other.high);
        Self::ordered_sum(
            product.high,
            product.low + (self.high * other.low + self.low * other.high),
        )
    }

    pub(crate) const fn over(self, other: Self) -> Self {
        // Three digits of a long division in base 2⁵³.
        let first = self.high / other.high;
        let rest = self.minus(other.times(Self::new(first)));
        let second = rest.high / other.high;
        let rest = rest.minus(other.times(Self::new(second)));
        let third = rest.high / other.high;
        Self::ordered_sum(first, second).plus(Self::new(third))
    }

    /// Half of it; exact.
    pub(crate) const fn half(self) -> Self {
        Self {
            high: 0.5 * self.high,
            low: 0.5 * self.low,
        }
    }

    pub(crate) const fn magnitude(self) -> f64 {
        self.high.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_of_three_is_one_to_thirty_digits() {
        let three = DoubleDouble::integer(3);
        let error = DoubleDouble::ONE
            .over(three)
            .times(three)
            .minus(DoubleDouble::ONE);
        // 2⁻¹⁰⁴ is the unit of 106 significant bits less two.
        assert!(error.magnitude() < 5e-32, "{error:?}");
    }

    #[test]
    fn the_sum_keeps_what_one_number_would_lose() {
        let tiny = DoubleDouble::new(1e-25);
        let kept = DoubleDouble::ONE.plus(tiny).minus(DoubleDouble::ONE);
        assert!((kept.high - 1e-25).abs() < 1e-31);
    }

    /// A finite number as an integer of 53 bits times a power of two.
    fn integer_of(number: f64) -> (i128, i32) {
        let bits = number.to_bits();
        let exponent = i32::try_from((bits >> 52) & 0x7ff).expect("eleven bits");
        let mantissa = i128::from((bits & ((1 << 52) - 1)) | (1 << 52));
        (mantissa * number.signum() as i128, exponent - 1075)
    }

    /// Integers of 106 bits have all digits of a product.
    #[test]
    fn products_of_large_numbers_are_exact() {
        for (a, b) in [
            (1.1, 1.3),
            (1.7e300, 1.1),
            (-1.7e308, 1.0 / 3.0),
            (0.7, 1.6e308),
            (1e305, -3.3e-290),
            (1.3e154, 1.3e154),
            (f64::MAX, 1.0 - f64::EPSILON),
        ] {
            let product = DoubleDouble::product(a, b);
            let ((x, by_x), (y, by_y)) = (integer_of(a), integer_of(b));
            let ((high, by_high), (low, by_low)) =
                (integer_of(product.high), integer_of(product.low));
            let exponent = by_x + by_y;
            // The low part has bits of the product only.
            let down = u32::try_from(exponent - by_low).expect("below the last bit");
            assert_eq!(low % (1 << down), 0, "{a:e} {b:e}");
            let sum = (high << (by_high - exponent)) + (low >> down);
            assert_eq!(sum, x * y, "{a:e} {b:e}");
        }
        let infinite = DoubleDouble::product(1e200, 1e200);
        assert!(infinite.high == f64::INFINITY);
        assert!(DoubleDouble::product(f64::NAN, 1e305).low.is_nan());
    }

    #[test]
    fn works_in_constants() {
        const SEVENTH: DoubleDouble = DoubleDouble::ONE.over(DoubleDouble::integer(7));
        assert_eq!(SEVENTH, DoubleDouble::ONE.over(DoubleDouble::integer(7)));
    }
}
