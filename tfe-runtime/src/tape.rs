//! Numbers that write down how they follow from parameters: one kernel call, read backwards, gives the derivatives of a sum of its results by all parameters.
//!
//! Dual numbers give the derivatives of all results by one parameter. What is wanted of an element backwards (T-127) is one number's derivative by all: with weights w of the results r,
//!
//! ```text
//! ∂(w·r)/∂a = Σ over operations from the last to the first: adjoint of an operand += adjoint of the result × ∂result/∂operand .        (T-149)
//! ```
//!
//! Only operations that a parameter has a part in are written down; coordinates, velocities and the time are mere numbers.

use crate::model::{First, Model};
use crate::real::Real;
use alloc::vec::Vec;
use core::cell::RefCell;
use core::fmt;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// No operand, or a number that no parameter has a part in.
const NONE: u32 = u32::MAX;

/// One operation: its operands and the derivatives by them. A parameter has its index as `first`, and `second` is itself.
#[derive(Clone, Copy, Debug)]
struct Operation {
    first: u32,
    second: u32,
    by_first: f64,
    by_second: f64,
}

/// The operations of one kernel call.
#[derive(Debug, Default)]
pub(crate) struct Tape {
    operations: RefCell<Vec<Operation>>,
    adjoints: Vec<f64>,
}

impl Tape {
    /// Adds Σ weights · ∂(first derivatives and forces)/∂a to `sums` for every parameter a.
    pub(crate) fn add_derivatives<M: Model<N>, const N: usize>(
        &mut self,
        model: &M,
        (t, q, z): (f64, &[f64; N], &[f64; N]),
        weights: &First<f64, N>,
        sums: &mut [f64],
    ) {
        self.operations.borrow_mut().clear();
        self.adjoints.clear();
        let ends = {
            let number = |value| Taped {
                value,
                place: NONE,
                tape: None,
            };
            let time = Taped {
                tape: Some(&self.operations),
                ..number(t)
            };
            let mut first = First::zero();
            model.first(time, &q.map(number), &z.map(number), &mut first);
            let parts = [first.z, first.q, first.force];
            parts.map(|part| part.map(|result| result.place))
        };
        let operations = self.operations.borrow();
        self.adjoints.resize(operations.len(), 0.0);
        for (places, weights) in ends.iter().zip([&weights.z, &weights.q, &weights.force]) {
            for (place, weight) in places.iter().zip(weights) {
                if let Some(adjoint) = self.adjoints.get_mut(*place as usize) {
                    *adjoint += weight;
                }
            }
        }
        read_backwards(&operations, &mut self.adjoints, sums);
    }
}

/// From the adjoints of results to the derivatives by parameters (T-149).
fn read_backwards(operations: &[Operation], adjoints: &mut [f64], sums: &mut [f64]) {
    for (place, operation) in operations.iter().enumerate().rev() {
        let adjoint = adjoints[place];
        // An infinite derivative along which nothing changes is none.
        if adjoint == 0.0 {
            continue;
        }
        if operation.second as usize == place {
            if let Some(sum) = sums.get_mut(operation.first as usize) {
                *sum += adjoint;
            }
            continue;
        }
        adjoints[operation.first as usize] += adjoint * operation.by_first;
        if operation.second != NONE {
            adjoints[operation.second as usize] += adjoint * operation.by_second;
        }
    }
}

/// A number and the place where the operation stands that it comes from.
#[derive(Clone, Copy)]
pub(crate) struct Taped<'t> {
    value: f64,
    place: u32,
    /// Where its operation stands; of the time, where those of parameters are to stand.
    tape: Option<&'t RefCell<Vec<Operation>>>,
}

impl fmt::Debug for Taped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.value.fmt(f)
    }
}

impl Taped<'_> {
    /// f(x), with f′(x).
    #[inline]
    fn one(self, value: f64, slope: impl FnOnce() -> f64) -> Self {
        match self.tape {
            Some(tape) if self.place != NONE => Self {
                value,
                ..self.written(tape, (self.place, slope()), (NONE, 0.0))
            },
            _ => Self::from_f64(value),
        }
    }

    /// f(x, y), with both derivatives.
    #[inline]
    fn two(
        self,
        other: Self,
        value: f64,
        by_self: impl FnOnce() -> f64,
        by_other: impl FnOnce() -> f64,
    ) -> Self {
        if other.place == NONE {
            return self.one(value, by_self);
        }
        if self.place == NONE {
            return other.one(value, by_other);
        }
        match self.tape {
            Some(tape) => Self {
                value,
                ..self.written(tape, (self.place, by_self()), (other.place, by_other()))
            },
            None => Self::from_f64(value),
        }
    }

    #[inline]
    fn written(
        self,
        tape: &RefCell<Vec<Operation>>,
        (first, by_first): (u32, f64),
        (second, by_second): (u32, f64),
    ) -> Self {
        let mut operations = tape.borrow_mut();
        let place = operations.len() as u32;
        operations.push(Operation {
            first,
            second,
            by_first,
            by_second,
        });
        Self { place, ..self }
    }
}

impl Add for Taped<'_> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.two(other, self.value + other.value, || 1.0, || 1.0)
    }
}

impl Sub for Taped<'_> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self.two(other, self.value - other.value, || 1.0, || -1.0)
    }
}

impl Mul for Taped<'_> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let product = self.value * other.value;
        self.two(other, product, || other.value, || self.value)
    }
}

impl Div for Taped<'_> {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let ratio = self.value / other.value;
        self.two(other, ratio, || 1.0 / other.value, || -ratio / other.value)
    }
}

impl Neg for Taped<'_> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.one(-self.value, || -1.0)
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

impl Real for Taped<'_> {
    type Mask = bool;

    #[inline]
    fn from_f64(value: f64) -> Self {
        Self {
            value,
            place: NONE,
            tape: None,
        }
    }
    fn parameter(self, index: usize, value: f64) -> Self {
        let Some(tape) = self.tape else {
            return Self::from_f64(value);
        };
        let place = tape.borrow().len() as u32;
        Self {
            value,
            ..self.written(tape, (index as u32, 0.0), (place, 0.0))
        }
    }
    fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
        // Inputs are functions of the time, in which no parameter has a part.
        self.one(function(self.value), || f64::NAN)
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Real::sin_cos(self.value);
        (self.one(sin, || cos), self.one(cos, || -sin))
    }
    fn sin(self) -> Self {
        self.one(Real::sin(self.value), || Real::cos(self.value))
    }
    fn cos(self) -> Self {
        self.one(Real::cos(self.value), || -Real::sin(self.value))
    }
    fn tan(self) -> Self {
        let tan = Real::tan(self.value);
        self.one(tan, || 1.0 + tan * tan)
    }
    fn asin(self) -> Self {
        let x = self.value;
        self.one(Real::asin(x), || 1.0 / Real::sqrt(1.0 - x * x))
    }
    fn acos(self) -> Self {
        let x = self.value;
        self.one(Real::acos(x), || -1.0 / Real::sqrt(1.0 - x * x))
    }
    fn atan(self) -> Self {
        let x = self.value;
        self.one(Real::atan(x), || 1.0 / (1.0 + x * x))
    }
    fn atan2(self, x: Self) -> Self {
        let square = x.value * x.value + self.value * self.value;
        let angle = Real::atan2(self.value, x.value);
        self.two(x, angle, || x.value / square, || -self.value / square)
    }
    fn sinh(self) -> Self {
        self.one(Real::sinh(self.value), || Real::cosh(self.value))
    }
    fn cosh(self) -> Self {
        self.one(Real::cosh(self.value), || Real::sinh(self.value))
    }
    fn tanh(self) -> Self {
        let tanh = Real::tanh(self.value);
        self.one(tanh, || 1.0 - tanh * tanh)
    }
    fn asinh(self) -> Self {
        let x = self.value;
        self.one(Real::asinh(x), || 1.0 / Real::sqrt(x * x + 1.0))
    }
    fn acosh(self) -> Self {
        let x = self.value;
        self.one(Real::acosh(x), || 1.0 / Real::sqrt(x * x - 1.0))
    }
    fn atanh(self) -> Self {
        let x = self.value;
        self.one(Real::atanh(x), || 1.0 / (1.0 - x * x))
    }
    fn exp(self) -> Self {
        let exp = Real::exp(self.value);
        self.one(exp, || exp)
    }
    fn ln(self) -> Self {
        self.one(Real::ln(self.value), || 1.0 / self.value)
    }
    fn sqrt(self) -> Self {
        let root = Real::sqrt(self.value);
        self.one(root, || 0.5 / root)
    }
    fn abs(self) -> Self {
        self.one(Real::abs(self.value), || Real::sign(self.value))
    }
    fn sign(self) -> Self {
        Self::from_f64(Real::sign(self.value))
    }
    fn min(self, other: Self) -> Self {
        Self::select(other.value < self.value, other, self)
    }
    fn max(self, other: Self) -> Self {
        Self::select(self.value < other.value, other, self)
    }
    fn hypot(self, other: Self) -> Self {
        let root = Real::hypot(self.value, other.value);
        self.two(other, root, || self.value / root, || other.value / root)
    }
    fn powi(self, exponent: i32) -> Self {
        let power = |exponent| Real::powi(self.value, exponent);
        self.one(power(exponent), || match exponent {
            0 => 0.0,
            _ => f64::from(exponent) * power(exponent.saturating_sub(1)),
        })
    }
    fn powf(self, exponent: Self) -> Self {
        let (x, y) = (self.value, exponent.value);
        let power = Real::powf(x, y);
        self.two(
            exponent,
            power,
            || y * Real::powf(x, y - 1.0),
            || power * Real::ln(x),
        )
    }
    fn less(self, other: Self) -> bool {
        self.value < other.value
    }
    fn less_or_equal(self, other: Self) -> bool {
        self.value <= other.value
    }
    fn select(mask: bool, then: Self, otherwise: Self) -> Self {
        if mask { then } else { otherwise }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;
    use alloc::vec;

    /// Functions of two parameters, in any numbers.
    fn values<R: Real>(x: R, y: R) -> [(&'static str, R); 15] {
        let (sin, cos) = x.sin_cos();
        [
            ("sums", x + y - x * x.like(3.0)),
            ("products", x * y * x),
            ("ratios", x / y + x.like(2.0) / x - y / x.like(3.0)),
            ("negative", -(x * y)),
            ("sines", sin * cos + (x * y).sin() - y.cos()),
            ("tan", (x * y).tan()),
            ("arcs", x.asin() + y.acos() * x.atan()),
            (
                "atan2",
                x.atan2(y) + x.atan2(x.like(0.7)) + x.like(0.7).atan2(y),
            ),
            ("hyperbolic", x.sinh() * y.cosh() + (x * y).tanh()),
            ("area", x.asinh() + (x + x.like(1.0)).acosh() * y.atanh()),
            ("exponential", (x * y).exp() + x.ln() * y.sqrt()),
            ("sizes", (-x).abs() * y + x.sign() + x.hypot(y)),
            (
                "choices",
                x.min(y) * x.like(2.0) + x.max(y) * x.max(x.like(5.0)),
            ),
            (
                "select",
                R::select(x.less(y), x * y, x / y) + R::select(y.less_or_equal(x), x, y * y),
            ),
            (
                "powers",
                x.powi(3) + y.powi(0) + y.powi(-2) + x.powf(y) + x.powf(x.like(1.5)),
            ),
        ]
    }

    /// Every function by both parameters, as dual numbers have it.
    #[test]
    fn backwards_is_forwards() {
        let (x, y) = (0.37, 0.61);
        let tape = RefCell::new(Vec::new());
        let time = Taped {
            tape: Some(&tape),
            ..Taped::from_f64(0.0)
        };
        let results = values(time.parameter(0, x), time.parameter(1, y));
        let operations = tape.borrow();
        let by_x = values(Dual::new(x, 1.0), Dual::new(y, 0.0));
        let by_y = values(Dual::new(x, 0.0), Dual::new(y, 1.0));
        for (at, (name, result)) in results.iter().enumerate() {
            let mut adjoints = vec![0.0; operations.len()];
            adjoints[result.place as usize] = 1.0;
            let mut sums = [0.0; 2];
            read_backwards(&operations, &mut adjoints, &mut sums);
            assert_eq!(result.value, by_x[at].1.value, "{name}");
            for (sum, forwards) in sums.iter().zip([by_x[at].1.slope, by_y[at].1.slope]) {
                let size = forwards.abs().max(1.0);
                assert!(
                    (sum - forwards).abs() < 4e-15 * size,
                    "{name}: {sum} {forwards}"
                );
            }
        }
    }
}
