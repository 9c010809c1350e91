//! Scalars with error-free products and sums.

use crate::double_double::DoubleDouble;
use crate::real::{Real, fused};

/// Scalars with error-free products and sums (a result and its rounding error).
pub trait Precise: Real {
    /// The product and its rounding error, exactly.
    fn product(self, other: Self) -> (Self, Self);

    /// `self` · `factor` + `term` with one rounding ([`fused`]).
    fn times_plus(self, factor: Self, term: Self) -> Self;

    /// The sum and its rounding error, exactly.
    #[inline(always)]
    fn exact_sum(self, other: Self) -> (Self, Self) {
        let high = self + other;
        let part = high - self;
        (high, (self - (high - part)) + (other - part))
    }

    /// The same if the magnitude of `self` is not below that of `smaller`; otherwise the error is not exact, but
    /// correct to the working precision of `smaller`.
    #[inline(always)]
    fn exact_sum_with(self, smaller: Self) -> (Self, Self) {
        let high = self + smaller;
        (high, smaller - (high - self))
    }

    /// The larger one; of a NaN and another number, the second.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self::select(other.less(self), self, other)
    }
}

/// weight · value, and its rounding error, including the contribution of that of the weight.
#[inline(always)]
pub(crate) fn exact_term<V: Precise>((weight, weight_low): (V, V), value: V) -> (V, V) {
    let (product, rest) = weight.product(value);
    (product, weight_low.times_plus(value, rest))
}

/// Adds a term to a sum; both are pairs of a number and its rounding error.
#[inline(always)]
pub(crate) fn add_exactly<V: Precise>(sum: &mut (V, V), (term, term_low): (V, V)) {
    let (high, lost) = sum.0.exact_sum(term);
    *sum = (high, sum.1 + (term_low + lost));
}

impl Precise for f64 {
    #[inline(always)]
    fn product(self, other: Self) -> (Self, Self) {
        let product = DoubleDouble::product(self, other);
        (product.high, product.low)
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, term: Self) -> Self {
        fused(self, factor, term)
    }
}
