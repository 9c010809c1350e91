//! Numbers that write down what is compared: a kernel evaluated with them tells its switching functions, and which of them have a part in its results.

use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;
use core::cell::RefCell;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Where switching functions are written, in the order in which a kernel comes to them, and which of them have decided what.
#[derive(Debug)]
pub(crate) struct Log(RefCell<Notes>);

#[derive(Debug)]
struct Notes {
    /// Of the switching functions.
    values: Vec<f64>,
    /// What has decided numbers; an [`Origin`] is a place in it.
    deciders: Vec<Decider>,
}

#[derive(Clone, Copy, Debug)]
enum Decider {
    /// The sign of a switching function.
    Switch(usize),
    Both(Origin, Origin),
}

/// What has decided a number, if anything has.
pub(crate) type Origin = Option<usize>;

impl Log {
    /// An empty one, in memory that may be used.
    pub(crate) fn new(mut values: Vec<f64>) -> Self {
        values.clear();
        Self(RefCell::new(Notes {
            values,
            deciders: Vec::new(),
        }))
    }

    /// The values of all switching functions. Those that decide nothing of results of these origins are zero, which has no sign: the |x| in max(|x| − a, 0) near x = 0.
    pub(crate) fn decisive(self, mut origins: Vec<Origin>) -> Vec<f64> {
        let Notes { values, deciders } = self.0.into_inner();
        let (mut known, mut decisive) = (vec![false; deciders.len()], vec![0.0; values.len()]);
        while let Some(origin) = origins.pop() {
            let Some(place) = origin else { continue };
            if core::mem::replace(&mut known[place], true) {
                continue;
            }
            match deciders[place] {
                Decider::Switch(switch) => decisive[switch] = values[switch],
                Decider::Both(one, other) => origins.extend([one, other]),
            }
        }
        decisive
    }

    fn note(&self, value: f64) -> Origin {
        let mut notes = self.0.borrow_mut();
        let switch = notes.values.len();
        notes.values.push(value);
        notes.deciders.push(Decider::Switch(switch));
        Some(notes.deciders.len() - 1)
    }

    fn both(&self, one: Origin, other: Origin) -> Origin {
        if one.is_none() || one == other {
            return other;
        }
        if other.is_none() {
            return one;
        }
        let mut notes = self.0.borrow_mut();
        notes.deciders.push(Decider::Both(one, other));
        Some(notes.deciders.len() - 1)
    }
}

/// A number; those that depend on the time or the state know where to write.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watched<'a> {
    value: f64,
    log: Option<&'a Log>,
    /// Of the branch in which this is.
    origin: Origin,
    /// Whether it is constant in that branch.
    is_fixed: bool,
}

impl<'a> Watched<'a> {
    pub(crate) fn new(value: f64, log: &'a Log) -> Self {
        Self {
            value,
            log: Some(log),
            origin: None,
            is_fixed: false,
        }
    }

    /// A constant.
    pub(crate) fn unwatched(value: f64) -> Self {
        Self {
            value,
            log: None,
            origin: None,
            is_fixed: true,
        }
    }

    /// What has decided it.
    pub(crate) fn origin(self) -> Origin {
        self.origin
    }

    fn of(self, value: f64) -> Self {
        Self { value, ..self }
    }

    fn with(self, other: Self, value: f64) -> Self {
        let log = self.log.or(other.log);
        Self {
            value,
            log,
            origin: log.and_then(|log| log.both(self.origin, other.origin)),
            is_fixed: self.is_fixed && other.is_fixed,
        }
    }

    /// The same, which the sign of `value` has decided, too.
    fn decided_by(self, value: f64) -> Self {
        let Some(log) = self.log else { return self };
        Self {
            origin: log.both(self.origin, log.note(value)),
            ..self
        }
    }

    /// One of two, which the sign of their difference has decided.
    fn chosen(is_first: bool, first: Self, second: Self) -> Self {
        let chosen = if is_first { first } else { second };
        Self {
            log: first.log.or(second.log),
            ..chosen
        }
        .decided_by(first.value - second.value)
    }

    /// Whether what it is a factor of vanishes.
    fn vanishes(self) -> bool {
        self.is_fixed && self.value == 0.0
    }
}

/// What a comparison gives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice<'a> {
    holds: bool,
    /// A number that has been decided by nothing else.
    decided: Watched<'a>,
}

impl<'a> Choice<'a> {
    fn by(holds: bool, a: Watched<'a>, b: Watched<'a>) -> Self {
        let plain = Watched {
            origin: None,
            ..a.with(b, 0.0)
        };
        Self {
            holds,
            decided: plain.decided_by(a.value - b.value),
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
    Div div /;
}

impl Mul for Watched<'_> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = self.with(other, self.value * other.value);
        match [self, other].into_iter().find(|factor| factor.vanishes()) {
            Some(zero) => Self {
                origin: zero.origin,
                is_fixed: true,
                ..product
            },
            None => product,
        }
    }
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

impl<'a> Real for Watched<'a> {
    type Mask = Choice<'a>;

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
        self.decided_by(self.value).of(Real::abs(self.value))
    }
    fn sign(self) -> Self {
        let decided = Self {
            origin: None,
            is_fixed: true,
            ..self
        };
        let sign = decided.of(Real::sign(self.value));
        sign.decided_by(self.value)
    }
    fn min(self, other: Self) -> Self {
        let chosen = Self::chosen(self.value < other.value, self, other);
        chosen.of(Real::min(self.value, other.value))
    }
    fn max(self, other: Self) -> Self {
        let chosen = Self::chosen(self.value > other.value, self, other);
        chosen.of(Real::max(self.value, other.value))
    }
    fn less(self, other: Self) -> Choice<'a> {
        Choice::by(self.value < other.value, self, other)
    }
    fn less_or_equal(self, other: Self) -> Choice<'a> {
        Choice::by(self.value <= other.value, self, other)
    }
    fn select(mask: Choice<'a>, then: Self, otherwise: Self) -> Self {
        let chosen = if mask.holds { then } else { otherwise };
        let decided = chosen.with(mask.decided, chosen.value);
        Self {
            // It depends on the state even where this branch does not.
            log: decided.log.or(then.log).or(otherwise.log),
            is_fixed: chosen.is_fixed,
            ..decided
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The switching functions of f at x.
    fn switches(x: f64, f: impl for<'a> Fn(Watched<'a>) -> Watched<'a>) -> Vec<f64> {
        let log = Log::new(Vec::new());
        let origin = f(Watched::new(x, &log)).origin();
        log.decisive(vec![origin])
    }

    fn number<'a>(value: f64) -> Watched<'a> {
        Watched::unwatched(value)
    }

    #[test]
    fn what_decides_nothing_has_no_sign() {
        // A gap: |x| counts outside alone.
        let gap = |x: f64| switches(x, |x| (x.abs() - number(1.0)).max(number(0.0)));
        assert_eq!(gap(0.25), [0.0, -0.75]);
        assert_eq!(gap(-1.5), [-1.5, 0.5]);
        // So does the direction that it is multiplied by.
        let push = |x: f64| switches(x, |x| x.sign() * (x.abs() - number(1.0)).max(number(0.0)));
        assert_eq!(push(0.25), [0.0, 0.0, -0.75]);
        assert_eq!(push(-1.5), [-1.5, -1.5, 0.5]);
        // A zero by chance is none that stays.
        assert_eq!(switches(0.0, |x| x.sign() * (x * x)), [0.0]);
        assert_eq!(switches(2.0, |x| (x - number(2.0)) * x.sign()), [2.0]);
    }

    #[test]
    fn branches_count_where_they_are_taken() {
        let nested = |x: f64| {
            switches(x, |x| {
                let inner = x.abs();
                Watched::select(x.less(number(3.0)), x * x, inner)
            })
        };
        assert_eq!(nested(-2.0), [0.0, -5.0]);
        assert_eq!(nested(4.0), [4.0, 1.0]);
        // A comparison counts by its own sign alone.
        let band = |x: f64| {
            switches(x, |x| {
                Watched::select(x.abs().less(number(1.0)), number(0.5), x)
            })
        };
        assert_eq!(band(0.1), [0.0, -0.9]);
    }
}
