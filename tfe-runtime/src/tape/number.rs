//! Numbers that record their operations, and the arithmetic of these.

use super::operations::{NONE, Operand, Operations, Row, Slope};
use core::array::from_fn;
use core::cell::RefCell;
use core::fmt;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A number for each point, and the place on the tape of the operation that has made it.
#[derive(Clone, Copy)]
pub(crate) struct Taped<'t> {
    pub(super) value: Row,
    pub(super) place: u32,
    /// The tape, if the number is recorded; the time carries the tape on which parameters are recorded.
    pub(super) tape: Option<&'t RefCell<Operations>>,
}

impl fmt::Debug for Taped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.value.fmt(f)
    }
}

impl<'t> Taped<'t> {
    /// The time argument, with the tape on which parameters are recorded.
    #[inline]
    pub(crate) fn time(value: Row, tape: &'t RefCell<Operations>) -> Self {
        Self {
            tape: Some(tape),
            ..Self::of(value)
        }
    }

    /// A number by which derivatives are taken, as if it were the parameter at this place.
    pub(crate) fn variable(value: Row, place: usize, tape: &'t RefCell<Operations>) -> Self {
        Self {
            place: place as u32,
            ..Self::time(value, tape)
        }
    }

    /// The place of its operation on the tape.
    pub(crate) fn place(&self) -> u32 {
        self.place
    }

    /// Constants, which are not recorded.
    #[inline]
    pub(crate) fn of(value: Row) -> Self {
        Self {
            value,
            place: NONE,
            tape: None,
        }
    }

    /// Records y = f(x), with the derivative f′ as a function of x and y.
    #[inline]
    pub(super) fn one(self, f: impl Fn(f64) -> f64, slope: impl Fn(f64, f64) -> f64) -> Self {
        let value = self.value.map(f);
        let slope = |lane: usize| slope(self.value[lane], value[lane]);
        self.follows(value, || Slope::Of(from_fn(slope)))
    }

    /// The same with a known value.
    #[inline]
    pub(super) fn follows(self, value: Row, slope: impl FnOnce() -> Slope) -> Self {
        match self.tape {
            Some(tape) if self.place != NONE => Self {
                value,
                ..self.written(tape, (self.place, slope()), None)
            },
            _ => Self::of(value),
        }
    }

    /// Records z = f(x, y), with both derivatives as functions of x, y and z.
    #[inline]
    pub(super) fn two(
        self,
        other: Self,
        f: impl Fn(f64, f64) -> f64,
        by_self: impl Fn(f64, f64, f64) -> f64,
        by_other: impl Fn(f64, f64, f64) -> f64,
    ) -> Self {
        let (x, y) = (self.value, other.value);
        let z: Row = from_fn(|lane| f(x[lane], y[lane]));
        let by_self = || Slope::Of(from_fn(|lane| by_self(x[lane], y[lane], z[lane])));
        let by_other = || Slope::Of(from_fn(|lane| by_other(x[lane], y[lane], z[lane])));
        self.follow(other, z, by_self, by_other)
    }

    /// The same with a known value.
    #[inline]
    pub(super) fn follow(
        self,
        other: Self,
        value: Row,
        by_self: impl FnOnce() -> Slope,
        by_other: impl FnOnce() -> Slope,
    ) -> Self {
        if other.place == NONE {
            return self.follows(value, by_self);
        }
        if self.place == NONE {
            return other.follows(value, by_other);
        }
        match self.tape {
            Some(tape) => Self {
                value,
                ..self.written(
                    tape,
                    (self.place, by_self()),
                    Some((other.place, by_other())),
                )
            },
            None => Self::of(value),
        }
    }

    #[inline]
    fn written(
        self,
        tape: &RefCell<Operations>,
        first: (u32, Slope),
        second: Option<(u32, Slope)>,
    ) -> Self {
        let mut operations = tape.borrow_mut();
        let place = (operations.parameters + operations.list.len()) as u32;
        let first = operations.operand(first.0, first.1);
        let second = match second {
            Some((place, slope)) => operations.operand(place, slope),
            None => Operand::NONE,
        };
        operations.list.push([first, second]);
        Self { place, ..self }
    }

    /// x ± y.
    #[inline]
    fn sum(self, other: Self, f: impl Fn(f64, f64) -> f64, by_other: Slope) -> Self {
        let value = from_fn(|lane| f(self.value[lane], other.value[lane]));
        self.follow(other, value, || Slope::One, || by_other)
    }
}

impl Add for Taped<'_> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.sum(other, |x, y| x + y, Slope::One)
    }
}

impl Sub for Taped<'_> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self.sum(other, |x, y| x - y, Slope::MinusOne)
    }
}

impl Mul for Taped<'_> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        self.two(other, |x, y| x * y, |_, y, _| y, |x, _, _| x)
    }
}

impl Div for Taped<'_> {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        self.two(other, |x, y| x / y, |_, y, _| 1.0 / y, |_, y, z| -z / y)
    }
}

impl Neg for Taped<'_> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.follows(self.value.map(|x| -x), || Slope::MinusOne)
    }
}

impl AddAssign for Taped<'_> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Taped<'_> {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
