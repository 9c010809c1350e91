//! Numbers that write down what is compared: a kernel evaluated with them tells its switching functions.

use crate::real::Real;
use alloc::vec::Vec;
use core::cell::RefCell;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Where switching functions are written, in the order in which a kernel comes to them.
pub(crate) type Log = RefCell<Vec<f64>>;

/// A number; those that depend on the time or the state know where to write.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watched<'a> {
    value: f64,
    log: Option<&'a Log>,
}

impl<'a> Watched<'a> {
    pub(crate) fn new(value: f64, log: &'a Log) -> Self {
        Self {
            value,
            log: Some(log),
        }
    }

    /// A constant.
    pub(crate) fn unwatched(value: f64) -> Self {
        Self { value, log: None }
    }

    fn of(self, value: f64) -> Self {
        Self { value, ..self }
    }

    fn with(self, other: Self, value: f64) -> Self {
        Self {
            value,
            log: self.log.or(other.log),
        }
    }

    /// A choice by the sign of `value`.
    fn note(self, value: f64) {
        if let Some(log) = self.log {
            log.borrow_mut().push(value);
        }
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident $operator:tt;)*) => {
        $(impl $trait for Watched<'_> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                self.with(other, self.value $operator other.value)
            }
        })*
    };
}

operators! {
    Add add +;
    Sub sub -;
    Mul mul *;
    Div div /;
}

impl Neg for Watched<'_> {
    type Output = Self;
    fn neg(self) -> Self {
        self.of(-self.value)
    }
}

impl AddAssign for Watched<'_> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Watched<'_> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

macro_rules! smooth {
    ($($name:ident)*) => {
        $(fn $name(self) -> Self {
            self.of(Real::$name(self.value))
        })*
    };
}

impl Real for Watched<'_> {
    type Mask = bool;

    fn from_f64(value: f64) -> Self {
        Self::unwatched(value)
    }

    smooth!(sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp ln sqrt);

    fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
        self.of(function(self.value))
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Real::sin_cos(self.value);
        (self.of(sin), self.of(cos))
    }
    fn atan2(self, x: Self) -> Self {
        self.with(x, Real::atan2(self.value, x.value))
    }
    fn hypot(self, other: Self) -> Self {
        self.with(other, Real::hypot(self.value, other.value))
    }
    fn powi(self, exponent: i32) -> Self {
        self.of(Real::powi(self.value, exponent))
    }
    fn powf(self, exponent: Self) -> Self {
        self.with(exponent, Real::powf(self.value, exponent.value))
    }
    fn abs(self) -> Self {
        self.note(self.value);
        self.of(Real::abs(self.value))
    }
    fn sign(self) -> Self {
        self.note(self.value);
        self.of(Real::sign(self.value))
    }
    fn min(self, other: Self) -> Self {
        let both = self - other;
        both.note(both.value);
        both.of(Real::min(self.value, other.value))
    }
    fn max(self, other: Self) -> Self {
        let both = self - other;
        both.note(both.value);
        both.of(Real::max(self.value, other.value))
    }
    fn less(self, other: Self) -> bool {
        let both = self - other;
        both.note(both.value);
        self.value < other.value
    }
    fn less_or_equal(self, other: Self) -> bool {
        let both = self - other;
        both.note(both.value);
        self.value <= other.value
    }
    fn select(mask: bool, then: Self, otherwise: Self) -> Self {
        let chosen = if mask { then } else { otherwise };
        // It depends on the state even where this branch does not.
        then.with(otherwise, chosen.value)
    }
}
