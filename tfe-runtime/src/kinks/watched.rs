//! Numbers that record comparisons: a kernel evaluated with them gives its switching functions, and which of them
//! influence its results.

use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;
use core::cell::RefCell;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A number by whose sign a kernel may choose a branch: `f64`, or a dual number, which gives the slopes of switching
/// functions as well.
pub(crate) trait Signed: Real<Mask = bool> {}

impl<R: Real<Mask = bool>> Signed for R {}

/// Collects the switching functions in the order in which a kernel evaluates them, and which of them have decided which
/// results.
#[derive(Debug)]
pub(crate) struct Log<R = f64>(RefCell<Notes<R>>);

#[derive(Debug)]
struct Notes<R> {
    /// The values of the switching functions.
    values: Vec<R>,
    /// The records of decisions that do not fit into the bits of [`Origin`].
    deciders: Vec<Decider>,
}

#[derive(Clone, Copy, Debug)]
enum Decider {
    /// The sign of a switching function.
    Switch(usize),
    Both(usize, usize),
}

/// The number of switching functions with a bit of their own.
const EARLY: usize = 64;

/// The switching functions by which a number has been decided.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Origin {
    /// One bit for each of the first functions.
    early: u64,
    /// For the others, a place in the list of decisions.
    late: Option<usize>,
}

impl<R: Signed> Log<R> {
    /// An empty log, in memory that may be reused.
    pub(crate) fn new(mut values: Vec<R>) -> Self {
        values.clear();
        Self(RefCell::new(Notes {
            values,
            deciders: Vec::new(),
        }))
    }

    /// The union of the origins of several numbers.
    pub(crate) fn deciding<'a>(&self, numbers: impl Iterator<Item = &'a Watched<'a, R>>) -> Origin
    where
        R: 'a,
    {
        numbers.fold(Origin::default(), |all, one| self.both(all, one.origin))
    }

    /// The values of all switching functions. Those that are not in the origin, and so decide nothing in the results,
    /// are replaced by zero, which has no sign: for example the |x| in max(|x| − a, 0) near x = 0.
    pub(crate) fn decisive(self, Origin { early, late }: Origin) -> Vec<R> {
        let Notes {
            mut values,
            deciders,
        } = self.0.into_inner();
        let mut known = vec![false; deciders.len()];
        let mut places: Vec<usize> = late.into_iter().collect();
        let mut decides = vec![false; values.len().saturating_sub(EARLY)];
        while let Some(place) = places.pop() {
            if core::mem::replace(&mut known[place], true) {
                continue;
            }
            match deciders[place] {
                Decider::Switch(switch) => decides[switch - EARLY] = true,
                Decider::Both(one, other) => places.extend([one, other]),
            }
        }
        for (switch, value) in values.iter_mut().enumerate() {
            let decides = match switch.checked_sub(EARLY) {
                None => early >> switch & 1 == 1,
                Some(late) => decides[late],
            };
            if !decides {
                *value = R::from_f64(0.0);
            }
        }
        values
    }

    /// The values of all switching functions.
    pub(crate) fn values(self) -> Vec<R> {
        self.0.into_inner().values
    }

    #[inline]
    fn note(&self, value: R) -> Origin {
        let mut notes = self.0.borrow_mut();
        let switch = notes.values.len();
        notes.values.push(value);
        if switch < EARLY {
            return Origin {
                early: 1 << switch,
                late: None,
            };
        }
        notes.deciders.push(Decider::Switch(switch));
        Origin {
            early: 0,
            late: Some(notes.deciders.len() - 1),
        }
    }

    /// The union of two origins.
    #[inline]
    pub(crate) fn both(&self, one: Origin, other: Origin) -> Origin {
        let late = match (one.late, other.late) {
            (Some(a), Some(b)) if a != b => {
                let mut notes = self.0.borrow_mut();
                notes.deciders.push(Decider::Both(a, b));
                Some(notes.deciders.len() - 1)
            }
            (a, b) => a.or(b),
        };
        Origin {
            early: one.early | other.early,
            late,
        }
    }
}

/// A number; those that depend on the time or the state refer to the log.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watched<'a, R = f64> {
    value: R,
    log: Option<&'a Log<R>>,
    /// The decisions that led to the branch in which it was computed.
    origin: Origin,
    /// Whether it is constant in that branch.
    is_fixed: bool,
}

impl<'a, R: Signed> Watched<'a, R> {
    #[inline]
    pub(crate) fn new(value: R, log: &'a Log<R>) -> Self {
        Self {
            value,
            log: Some(log),
            origin: Origin::default(),
            is_fixed: false,
        }
    }

    #[inline]
    fn constant(value: R) -> Self {
        Self {
            value,
            log: None,
            origin: Origin::default(),
            is_fixed: true,
        }
    }

    #[inline]
    fn of(self, value: R) -> Self {
        Self { value, ..self }
    }

    #[inline]
    fn with(self, other: Self, value: R) -> Self {
        let log = self.log.or(other.log);
        Self {
            value,
            log,
            origin: log.map_or_else(Origin::default, |log| log.both(self.origin, other.origin)),
            is_fixed: self.is_fixed && other.is_fixed,
        }
    }

    /// The same number, with the sign of `value` as a further decision.
    #[inline]
    fn decided_by(self, value: R) -> Self {
        let Some(log) = self.log else { return self };
        Self {
            origin: log.both(self.origin, log.note(value)),
            ..self
        }
    }

    /// One of two numbers, chosen by the sign of their difference.
    #[inline]
    fn chosen(is_first: bool, first: Self, second: Self) -> Self {
        let chosen = if is_first { first } else { second };
        Self {
            log: first.log.or(second.log),
            ..chosen
        }
        .decided_by(first.value - second.value)
    }

    /// Whether a product with it vanishes.
    #[inline]
    fn vanishes(self) -> bool {
        let zero = R::from_f64(0.0);
        self.is_fixed && self.value.less_or_equal(zero) && zero.less_or_equal(self.value)
    }
}

/// The result of a comparison.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice<'a, R = f64> {
    holds: bool,
    /// A number that has been decided by nothing else.
    decided: Watched<'a, R>,
}

impl<'a, R: Signed> Choice<'a, R> {
    #[inline]
    fn by(holds: bool, a: Watched<'a, R>, b: Watched<'a, R>) -> Self {
        let plain = Watched {
            origin: Origin::default(),
            ..a.with(b, R::from_f64(0.0))
        };
        Self {
            holds,
            decided: plain.decided_by(a.value - b.value),
        }
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident $operator:tt;)*) => {
        $(impl<R: Signed> $trait for Watched<'_, R> {
            type Output = Self;
            #[inline]
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

impl<R: Signed> Mul for Watched<'_, R> {
    type Output = Self;
    #[inline]
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

impl<R: Signed> Neg for Watched<'_, R> {
    type Output = Self;
    fn neg(self) -> Self {
        self.of(-self.value)
    }
}

impl<R: Signed> AddAssign for Watched<'_, R> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<R: Signed> SubAssign for Watched<'_, R> {
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

impl<'a, R: Signed> Real for Watched<'a, R> {
    type Mask = Choice<'a, R>;

    #[inline]
    fn from_f64(value: f64) -> Self {
        Self::constant(R::from_f64(value))
    }

    #[inline]
    fn parameter(self, index: usize, value: f64) -> Self {
        Self::constant(self.value.parameter(index, value))
    }

    smooth!(sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp ln sqrt);

    #[inline]
    fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
        self.of(self.value.map(function))
    }
    #[inline]
    fn map_with_derivatives(self, derivatives: &mut dyn FnMut(u32, f64) -> f64) -> Self {
        self.of(self.value.map_with_derivatives(derivatives))
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Real::sin_cos(self.value);
        (self.of(sin), self.of(cos))
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        self.with(x, Real::atan2(self.value, x.value))
    }
    #[inline]
    fn hypot(self, other: Self) -> Self {
        self.with(other, Real::hypot(self.value, other.value))
    }
    #[inline]
    fn powi(self, exponent: i32) -> Self {
        self.of(Real::powi(self.value, exponent))
    }
    #[inline]
    fn powf(self, exponent: Self) -> Self {
        self.with(exponent, Real::powf(self.value, exponent.value))
    }
    #[inline]
    fn abs(self) -> Self {
        self.decided_by(self.value).of(Real::abs(self.value))
    }
    #[inline]
    fn sign(self) -> Self {
        let decided = Self {
            origin: Origin::default(),
            is_fixed: true,
            ..self
        };
        let sign = decided.of(Real::sign(self.value));
        sign.decided_by(self.value)
    }
    #[inline]
    fn min(self, other: Self) -> Self {
        let chosen = Self::chosen(self.value.less(other.value), self, other);
        chosen.of(Real::min(self.value, other.value))
    }
    #[inline]
    fn max(self, other: Self) -> Self {
        let chosen = Self::chosen(other.value.less(self.value), self, other);
        chosen.of(Real::max(self.value, other.value))
    }
    #[inline]
    fn less(self, other: Self) -> Choice<'a, R> {
        Choice::by(self.value.less(other.value), self, other)
    }
    #[inline]
    fn less_or_equal(self, other: Self) -> Choice<'a, R> {
        Choice::by(self.value.less_or_equal(other.value), self, other)
    }
    #[inline]
    fn select(mask: Choice<'a, R>, then: Self, otherwise: Self) -> Self {
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
        let origin = f(Watched::new(x, &log)).origin;
        log.decisive(origin)
    }

    fn number<'a>(value: f64) -> Watched<'a> {
        Watched::from_f64(value)
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
    fn hundreds_of_functions_are_told_apart() {
        let log = Log::new(Vec::new());
        let numbers: Vec<Watched<'_>> = (0..200)
            .map(|k| {
                let gap = Watched::new(f64::from(k) / 100.0 - 0.995, &log).abs();
                (gap - number(0.5)).max(number(0.0))
            })
            .collect();
        let sum = numbers
            .into_iter()
            .reduce(|sum, one| sum + one)
            .expect("some");
        let origin = sum.origin;
        let values = log.decisive(origin);
        assert_eq!(values.len(), 400);
        for (k, pair) in values.chunks(2).enumerate() {
            let is_open = (50..150).contains(&k);
            assert_eq!((pair[0] == 0.0, pair[1] == 0.0), (is_open, false), "{k}");
        }
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
