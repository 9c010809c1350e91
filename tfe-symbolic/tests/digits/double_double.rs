//! Numbers of twice the precision of `f64`, as unevaluated sums of two of them: about 32 decimal digits.
//!
//! Sums and products are those of Dekker and Knuth; functions are sums of Taylor's series after a reduction of the argument, good to
//! some units of 10⁻³⁰. Large or very small numbers have the range of `f64`, without its gradual underflow.

use std::sync::LazyLock;

/// hi + lo with |lo| at most half an ulp of hi.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct DoubleDouble {
    pub hi: f64,
    pub lo: f64,
}

/// 1/n! for n = 0, 1, …
static INVERSE_FACTORIALS: LazyLock<[DoubleDouble; 32]> = LazyLock::new(|| {
    let mut table = [DoubleDouble::from(1.0); 32];
    for n in 1..32 {
        table[n] = table[n - 1].divide(DoubleDouble::from(n as f64));
    }
    table
});

/// π/2 in four parts.
const QUARTER_TURN: [f64; 4] = [
    std::f64::consts::FRAC_PI_2,
    6.123_233_995_736_766e-17,
    -1.497_384_904_859_169_8e-33,
    4.320_574_262_296_449e-50,
];

/// ln 2 in three parts.
const LN_2: [f64; 3] = [
    std::f64::consts::LN_2,
    2.319_046_813_846_299_6e-17,
    5.707_708_438_416_212e-34,
];

/// a + b and its error; exact.
fn two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    let part = hi - a;
    let lo = (a - (hi - part)) + (b - part);
    DoubleDouble { hi, lo }
}

/// The same for |a| ≥ |b|.
fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    DoubleDouble {
        hi,
        lo: b - (hi - a),
    }
}

/// a b and its error; exact.
fn two_product(a: f64, b: f64) -> DoubleDouble {
    let hi = a * b;
    DoubleDouble {
        hi,
        lo: a.mul_add(b, -hi),
    }
}

impl From<f64> for DoubleDouble {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl DoubleDouble {
    pub fn add(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.hi, other.hi), two_sum(self.lo, other.lo));
        let high = quick_two_sum(high.hi, high.lo + low.hi);
        quick_two_sum(high.hi, high.lo + low.lo)
    }

    pub fn negate(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }

    pub fn subtract(self, other: Self) -> Self {
        self.add(other.negate())
    }

    pub fn multiply(self, other: Self) -> Self {
        let product = two_product(self.hi, other.hi);
        let low = product.lo + (self.hi * other.lo + self.lo * other.hi);
        quick_two_sum(product.hi, low)
    }

    pub fn divide(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        let rest = self.subtract(other.multiply(Self::from(first)));
        let second = rest.hi / other.hi;
        let rest = rest.subtract(other.multiply(Self::from(second)));
        let third = rest.hi / other.hi;
        quick_two_sum(first, second).add(Self::from(third))
    }

    pub fn abs(self) -> Self {
        if self.hi < 0.0 { self.negate() } else { self }
    }

    /// By Newton's method from the root of `f64`.
    pub fn sqrt(self) -> Self {
        if self.hi == 0.0 {
            return self;
        }
        let guess = Self::from(self.hi.sqrt());
        let step = |root: Self| {
            let rest = self.subtract(root.multiply(root));
            root.add(Self::from(rest.hi / (2.0 * root.hi)))
        };
        step(step(guess))
    }

    /// x^n
    pub fn power(self, n: i32) -> Self {
        let mut result = Self::from(1.0);
        let mut square = self;
        let mut left = n.unsigned_abs();
        while left > 0 {
            if left & 1 == 1 {
                result = result.multiply(square);
            }
            left >>= 1;
            if left > 0 {
                square = square.multiply(square);
            }
        }
        if n < 0 {
            Self::from(1.0).divide(result)
        } else {
            result
        }
    }

    pub fn exp(self) -> Self {
        if self.hi > 709.0 {
            return Self::from(f64::INFINITY);
        }
        if self.hi < -700.0 {
            return Self::from(0.0);
        }
        let turns = (self.hi / LN_2[0]).round();
        let rest = self.reduced(turns, &LN_2);
        let sum = rest.series(0, 1, 28);
        let scale = 2f64.powi(turns as i32);
        Self {
            hi: sum.hi * scale,
            lo: sum.lo * scale,
        }
    }

    /// By Newton's method from the logarithm of `f64`.
    pub fn ln(self) -> Self {
        let step = |guess: Self| {
            let quotient = self.multiply(guess.negate().exp());
            guess.add(quotient.subtract(Self::from(1.0)))
        };
        step(step(Self::from(self.hi.ln())))
    }

    /// sin x and cos x
    pub fn sin_cos(self) -> (Self, Self) {
        let turns = (self.hi / QUARTER_TURN[0]).round();
        let rest = self.reduced(turns, &QUARTER_TURN);
        // With alternating signs, as series in −x².
        let square = rest.multiply(rest).negate();
        let cosine = square.even_series(0, 28);
        let sine = rest.multiply(square.even_series(1, 29));
        match turns.rem_euclid(4.0) as u8 {
            0 => (sine, cosine),
            1 => (cosine, sine.negate()),
            2 => (sine.negate(), cosine.negate()),
            _ => (cosine.negate(), sine),
        }
    }

    /// x − turns × period
    fn reduced(self, turns: f64, period: &[f64]) -> Self {
        period
            .iter()
            .fold(self, |rest, part| rest.subtract(two_product(turns, *part)))
    }

    /// Σ x^j/n! over n = first, first + step, … ≤ last with j = 0, 1, …
    fn series(self, first: usize, step: usize, last: usize) -> Self {
        let mut sum = Self::from(0.0);
        for n in (first..last + 1).step_by(step).rev() {
            sum = sum.multiply(self).add(INVERSE_FACTORIALS[n]);
        }
        sum
    }

    fn even_series(self, first: usize, last: usize) -> Self {
        self.series(first, 2, last)
    }
}
