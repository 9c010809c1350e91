//! Scalars of eight numbers: one register, or two registers of four. The operations of the two overlap in the
//! processor, where a single chain of operations would wait for itself.

use crate::precise::Precise;
use crate::real::Real;
use crate::registers::four::{self, Four};
use crate::registers::side::Side;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// The number of trajectories that share a kernel call.
pub const LANES: usize = 8;

/// Eight numbers, one for each of eight trajectories.
pub trait Eight: Side<LANES> {
    /// Whether at least one number is positive; none may be NaN.
    #[inline(always)]
    fn any_positive(self) -> bool {
        let mut largest = 0.0;
        for number in self.lanes() {
            largest = if largest < number { number } else { largest };
        }
        largest > 0.0
    }

    /// Runs the work with numbers of this kind.
    fn out_of_line<W: OutOfLine>(self, work: W);
}

/// Work in a function of its own, which is compiled for the instruction set of the numbers with which it computes.
pub trait OutOfLine {
    fn run<V: Eight>(self, like: V);
}

/// The same with pairs.
struct Paired<W>(W);

impl<W: OutOfLine> four::OutOfLine for Paired<W> {
    #[inline(always)]
    fn run<V: Four>(self, like: V) {
        self.0.run(Pair(like, like));
    }
}

/// The first four and the last four.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair<V>(pub(crate) V, pub(crate) V);

impl<V: Four> Side<LANES> for Pair<V> {
    #[inline(always)]
    fn with(self, [a, b, c, d, e, f, g, h]: [f64; LANES]) -> Self {
        Self(self.0.with([a, b, c, d]), self.1.with([e, f, g, h]))
    }

    #[inline(always)]
    fn lanes(self) -> [f64; LANES] {
        let ([a, b, c, d], [e, f, g, h]) = (self.0.lanes(), self.1.lanes());
        [a, b, c, d, e, f, g, h]
    }
}

impl<V: Four> Eight for Pair<V> {
    #[inline(always)]
    fn any_positive(self) -> bool {
        let [a, b, c, d] = self.0.larger(self.1).lanes();
        let (left, right) = (if a < b { b } else { a }, if c < d { d } else { c });
        left > 0.0 || right > 0.0
    }

    #[inline(always)]
    fn out_of_line<W: OutOfLine>(self, work: W) {
        self.0.out_of_line(Paired(work));
    }
}

impl<V: Four> Precise for Pair<V> {
    #[inline(always)]
    fn product(self, other: Self) -> (Self, Self) {
        let (first, second) = (self.0.product(other.0), self.1.product(other.1));
        (Self(first.0, second.0), Self(first.1, second.1))
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, term: Self) -> Self {
        Self(
            self.0.times_plus(factor.0, term.0),
            self.1.times_plus(factor.1, term.1),
        )
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self(self.0.larger(other.0), self.1.larger(other.1))
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident;)*) => {$(
        impl<V: Real> $operator for Pair<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    )*};
}
operators! { Add add; Sub sub; Mul mul; Div div; }

impl<V: Real> Neg for Pair<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<V: Real> AddAssign for Pair<V> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<V: Real> SubAssign for Pair<V> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

macro_rules! half_by_half {
    ($($name:ident($($argument:ident)?);)*) => {$(
        #[inline(always)]
        fn $name(self $(, $argument: Self)?) -> Self {
            Self(self.0.$name($($argument.0)?), self.1.$name($($argument.1)?))
        }
    )*};
}

impl<V: Four> Real for Pair<V> {
    type Mask = (V::Mask, V::Mask);

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self(V::from_f64(value), V::from_f64(value))
    }

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        let value = self.0.like(value);
        Self(value, value)
    }

    fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
        Self(self.0.map(function), self.1.map(function))
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (first, second) = self.0.sin_cos_of_two(self.1);
        (Self(first.0, second.0), Self(first.1, second.1))
    }

    #[inline(always)]
    fn sin(self) -> Self {
        let (first, second) = self.0.sin_of_two(self.1);
        Self(first, second)
    }

    #[inline(always)]
    fn cos(self) -> Self {
        let (first, second) = self.0.cos_of_two(self.1);
        Self(first, second)
    }

    half_by_half! {
        tan(); asin(); acos(); atan(); atan2(x); sinh(); cosh(); tanh(); asinh(); acosh(); atanh(); exp(); ln(); hypot(other);
        powf(exponent); sign(); min(other); max(other); sqrt(); abs();
    }

    #[inline(always)]
    fn powi(self, exponent: i32) -> Self {
        crate::real::integer_power(self, exponent)
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self::Mask {
        (self.0.less(other.0), self.1.less(other.1))
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> Self::Mask {
        (self.0.less_or_equal(other.0), self.1.less_or_equal(other.1))
    }

    #[inline(always)]
    fn select(mask: Self::Mask, then: Self, otherwise: Self) -> Self {
        Self(
            V::select(mask.0, then.0, otherwise.0),
            V::select(mask.1, then.1, otherwise.1),
        )
    }
}
