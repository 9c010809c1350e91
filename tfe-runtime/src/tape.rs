//! Reverse-mode differentiation: numbers that record their operations on a tape. One kernel call, read backwards, gives
//! the derivatives of a weighted sum of its results by all parameters.
//!
//! Dual numbers give the derivatives of all results by one parameter. The adjoint of an element (T-127) needs the
//! opposite, the derivatives of one number by all parameters: with weights w of the results r,
//!
//! ```text
//! ∂(w·r)/∂a = Σ over operations from the last to the first: adjoint of an operand += adjoint of the result × ∂result/∂operand .        (T-149)
//! ```
//!
//! Only operations that depend on a parameter are recorded; coordinates, velocities and the time are plain numbers.
//! Several points are evaluated side by side, as the operations are the same at all of them.

use crate::dual::below_one;
use crate::model::{First, Model};
use crate::real::Real;
use alloc::vec::Vec;
use core::array::from_fn;
use core::cell::RefCell;
use core::fmt;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// The number of points side by side. With more, the tape no longer fits into the cache: eight points take half as long
/// again.
pub(crate) const LANES: usize = 4;

/// A number for each point.
pub(crate) type Row = [f64; LANES];

const ZERO: Row = [0.0; LANES];

/// No operand, or one that depends on no parameter.
const NONE: u32 = u32::MAX;

/// The derivative of an operation by one of its operands.
#[derive(Clone, Copy, Debug)]
enum Slope {
    One,
    MinusOne,
    Of(Row),
}

/// An operand, and where the derivative by it is stored; for sums the derivative is known and takes no memory.
#[derive(Clone, Copy, Debug)]
struct Operand {
    place: u32,
    slope: u32,
}

impl Operand {
    const ONE: u32 = u32::MAX;
    const MINUS_ONE: u32 = u32::MAX - 1;
    const NONE: Self = Self {
        place: NONE,
        slope: Self::ONE,
    };
}

/// The recorded operations of one kernel call; the parameters occupy the places before them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Operations {
    parameters: usize,
    list: Vec<[Operand; 2]>,
    slopes: Vec<Row>,
}

impl Operations {
    #[inline]
    fn operand(&mut self, place: u32, slope: Slope) -> Operand {
        let slope = match slope {
            Slope::One => Operand::ONE,
            Slope::MinusOne => Operand::MINUS_ONE,
            Slope::Of(row) => {
                self.slopes.push(row);
                self.slopes.len() as u32 - 1
            }
        };
        Operand { place, slope }
    }
}

/// The arguments of kernels at several points, and the weights of the results.
pub(crate) struct Places<const N: usize> {
    count: usize,
    t: Row,
    q: [Row; N],
    z: [Row; N],
    /// The weights of the derivatives by z, of those by q, and of the forces.
    weights: [[Row; N]; 3],
}

impl<const N: usize> Places<N> {
    pub(crate) const NONE: Self = Self {
        count: 0,
        t: ZERO,
        q: [ZERO; N],
        z: [ZERO; N],
        weights: [[ZERO; N]; 3],
    };

    /// Whether all lanes are in use.
    pub(crate) fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds a point, if there is room.
    pub(crate) fn push(&mut self, (t, q, z): (f64, &[f64; N], &[f64; N]), weights: &First<f64, N>) {
        // Unused lanes repeat the first point with zero weights.
        let lanes = match self.count {
            0 => 0..LANES,
            count => count..count + 1,
        };
        self.t[lanes.clone()].fill(t);
        for a in 0..N {
            self.q[a][lanes.clone()].fill(q[a]);
            self.z[a][lanes.clone()].fill(z[a]);
            for (rows, part) in
                (self.weights.iter_mut()).zip([&weights.z, &weights.q, &weights.force])
            {
                rows[a][self.count] = part[a];
            }
        }
        self.count += 1;
    }
}

/// The operations of one kernel call, and the accumulated adjoints of all calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    operations: Operations,
    /// The adjoints of the parameters, summed over all calls, then those of the operations, which are zero between
    /// calls.
    adjoints: Vec<Row>,
}

impl Tape {
    /// Sets the sums of this many parameters to zero.
    pub(crate) fn begin(&mut self, parameters: usize) {
        let operations = &mut self.operations;
        if operations.parameters != parameters {
            self.adjoints.clear();
            operations.parameters = parameters;
        }
        let missing = parameters.saturating_sub(self.adjoints.len());
        self.adjoints.extend(core::iter::repeat_n(ZERO, missing));
        self.adjoints[..parameters].fill(ZERO);
    }

    /// The number of parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.operations.parameters
    }

    /// The sum of a parameter, by its index.
    pub(crate) fn sum(&self, parameter: usize) -> f64 {
        self.adjoints[parameter].iter().sum()
    }

    /// Adds Σ weights · ∂(first derivatives and forces)/∂a over the points to the sum of every parameter a, and clears
    /// the list of points.
    pub(crate) fn take_derivatives<M: Model<N>, const N: usize>(
        &mut self,
        model: &M,
        places: &mut Places<N>,
    ) {
        let ends = self.record(|operations| {
            let time = Taped::time(places.t, operations);
            let mut first = First::zero();
            model.first(
                time,
                &places.q.map(Taped::of),
                &places.z.map(Taped::of),
                &mut first,
            );
            let parts = [first.z, first.q, first.force];
            parts.map(|part| part.map(|result| result.place))
        });
        let weights = places.weights.as_flattened();
        self.read(ends.as_flattened().iter().copied().zip(weights));
        *places = Places::NONE;
    }

    /// Returns a sum and sets it to zero.
    #[cfg(feature = "sparse")]
    pub(crate) fn take(&mut self, place: usize) -> f64 {
        self.take_row(place).iter().sum()
    }

    /// Returns the parts of a sum, one for each point, and sets them to zero.
    pub(crate) fn take_row(&mut self, place: usize) -> Row {
        core::mem::replace(&mut self.adjoints[place], ZERO)
    }

    /// Runs a kernel whose numbers record their operations.
    pub(crate) fn record<P>(&mut self, kernel: impl FnOnce(&RefCell<Operations>) -> P) -> P {
        self.operations.list.clear();
        self.operations.slopes.clear();
        // The numbers share the tape for as long as the kernel runs.
        let operations = RefCell::new(core::mem::take(&mut self.operations));
        let ends = kernel(&operations);
        self.operations = operations.into_inner();
        ends
    }

    /// Reads the tape backwards, from the places of the results with their weights.
    pub(crate) fn read<'w>(&mut self, ends: impl Iterator<Item = (u32, &'w Row)>) {
        let operations = &self.operations;
        let count = operations.parameters + operations.list.len();
        if self.adjoints.len() < count {
            self.adjoints.resize(count, ZERO);
        }
        for (place, weights) in ends {
            if let Some(adjoint) = self.adjoints.get_mut(place as usize) {
                for lane in 0..LANES {
                    adjoint[lane] += weights[lane];
                }
            }
        }
        read_backwards(operations, &mut self.adjoints);
    }
}

/// Propagates the adjoints of the results to those of the parameters (T-149); the adjoints of the operations are zero
/// afterwards.
fn read_backwards(operations: &Operations, adjoints: &mut [Row]) {
    for (place, operation) in operations.list.iter().enumerate().rev() {
        let own = &mut adjoints[operations.parameters + place];
        let adjoint = core::mem::replace(own, ZERO);
        if adjoint == ZERO {
            continue;
        }
        for operand in operation {
            if operand.place == NONE {
                continue;
            }
            let sum = &mut adjoints[operand.place as usize];
            match operand.slope {
                Operand::ONE => (0..LANES).for_each(|lane| sum[lane] += adjoint[lane]),
                Operand::MINUS_ONE => (0..LANES).for_each(|lane| sum[lane] -= adjoint[lane]),
                slope => add(sum, &adjoint, &operations.slopes[slope as usize]),
            }
        }
    }
}

/// sum += adjoint · derivative, where an infinite derivative counts as zero if nothing changes along it: if the adjoint
/// is zero, or no parameter moves the operand.
#[inline]
fn add(sum: &mut Row, adjoint: &Row, derivative: &Row) {
    for lane in 0..LANES {
        let product = adjoint[lane] * derivative[lane];
        let is_none = (adjoint[lane] == 0.0) | (derivative[lane] == 0.0);
        sum[lane] += if is_none { 0.0 } else { product };
    }
}

/// A number for each point, and the place on the tape of the operation that has made it.
#[derive(Clone, Copy)]
pub(crate) struct Taped<'t> {
    value: Row,
    place: u32,
    /// The tape, if the number is recorded; the time carries the tape on which parameters are recorded.
    tape: Option<&'t RefCell<Operations>>,
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
    fn one(self, f: impl Fn(f64) -> f64, slope: impl Fn(f64, f64) -> f64) -> Self {
        let value = self.value.map(f);
        let slope = |lane: usize| slope(self.value[lane], value[lane]);
        self.follows(value, || Slope::Of(from_fn(slope)))
    }

    /// The same with a known value.
    #[inline]
    fn follows(self, value: Row, slope: impl FnOnce() -> Slope) -> Self {
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
    fn two(
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
    fn follow(
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

impl Real for Taped<'_> {
    type Mask = [bool; LANES];

    #[inline]
    fn from_f64(value: f64) -> Self {
        Self::of([value; LANES])
    }
    #[inline]
    fn parameter(self, index: usize, value: f64) -> Self {
        Self {
            value: [value; LANES],
            place: index as u32,
            ..self
        }
    }
    fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
        // Inputs are functions of the time, which does not depend on parameters.
        let value = self.value.map(function);
        self.follows(value, || Slope::Of([f64::NAN; LANES]))
    }
    fn sin_cos(self) -> (Self, Self) {
        let (mut sin, mut cos) = (ZERO, ZERO);
        for lane in 0..LANES {
            (sin[lane], cos[lane]) = Real::sin_cos(self.value[lane]);
        }
        (
            self.follows(sin, || Slope::Of(cos)),
            self.follows(cos, || Slope::Of(sin.map(|sin| -sin))),
        )
    }
    fn sin(self) -> Self {
        self.one(Real::sin, |x, _| Real::cos(x))
    }
    fn cos(self) -> Self {
        self.one(Real::cos, |x, _| -Real::sin(x))
    }
    fn tan(self) -> Self {
        self.one(Real::tan, |_, tan| 1.0 + tan * tan)
    }
    fn asin(self) -> Self {
        self.one(Real::asin, |x, _| 1.0 / Real::sqrt(below_one(x)))
    }
    fn acos(self) -> Self {
        self.one(Real::acos, |x, _| -1.0 / Real::sqrt(below_one(x)))
    }
    fn atan(self) -> Self {
        self.one(Real::atan, |x, _| 1.0 / (1.0 + x * x))
    }
    fn atan2(self, x: Self) -> Self {
        let by_y = |y: f64, x: f64, _: f64| x / (x * x + y * y);
        let by_x = |y: f64, x: f64, _: f64| -y / (x * x + y * y);
        self.two(x, Real::atan2, by_y, by_x)
    }
    fn sinh(self) -> Self {
        self.one(Real::sinh, |x, _| Real::cosh(x))
    }
    fn cosh(self) -> Self {
        self.one(Real::cosh, |x, _| Real::sinh(x))
    }
    fn tanh(self) -> Self {
        self.one(Real::tanh, |_, tanh| 1.0 - tanh * tanh)
    }
    fn asinh(self) -> Self {
        self.one(Real::asinh, |x, _| 1.0 / Real::sqrt(x * x + 1.0))
    }
    fn acosh(self) -> Self {
        let slope = |x: f64, _: f64| 1.0 / Real::sqrt((x - 1.0) * (x + 1.0));
        self.one(Real::acosh, slope)
    }
    fn atanh(self) -> Self {
        self.one(Real::atanh, |x, _| 1.0 / below_one(x))
    }
    fn exp(self) -> Self {
        self.one(Real::exp, |_, exp| exp)
    }
    fn ln(self) -> Self {
        self.one(Real::ln, |x, _| 1.0 / x)
    }
    fn sqrt(self) -> Self {
        self.one(Real::sqrt, |_, root| 0.5 / root)
    }
    fn abs(self) -> Self {
        self.one(Real::abs, |x, _| Real::sign(x))
    }
    fn sign(self) -> Self {
        Self::of(self.value.map(Real::sign))
    }
    fn min(self, other: Self) -> Self {
        Self::select(other.less(self), other, self)
    }
    fn max(self, other: Self) -> Self {
        Self::select(self.less(other), other, self)
    }
    fn hypot(self, other: Self) -> Self {
        // A length of zero has slope zero in every direction, as with dual numbers.
        let part = |x: f64, root: f64| if root == 0.0 { 0.0 } else { x / root };
        self.two(
            other,
            Real::hypot,
            |x, _, root| part(x, root),
            |_, y, root| part(y, root),
        )
    }
    fn powi(self, exponent: i32) -> Self {
        let slope = |x: f64, _: f64| match exponent {
            0 => 0.0,
            _ => f64::from(exponent) * Real::powi(x, exponent.saturating_sub(1)),
        };
        self.one(|x| Real::powi(x, exponent), slope)
    }
    fn powf(self, exponent: Self) -> Self {
        let by_base = |x: f64, y: f64, _: f64| y * Real::powf(x, y - 1.0);
        // Where the power vanishes, the logarithm is infinite and the slope zero.
        let by_exponent = |x: f64, _: f64, power: f64| {
            if power == 0.0 {
                0.0
            } else {
                power * Real::ln(x)
            }
        };
        self.two(exponent, Real::powf, by_base, by_exponent)
    }
    fn less(self, other: Self) -> Self::Mask {
        from_fn(|lane| self.value[lane] < other.value[lane])
    }
    fn less_or_equal(self, other: Self) -> Self::Mask {
        from_fn(|lane| self.value[lane] <= other.value[lane])
    }
    fn select(mask: Self::Mask, then: Self, otherwise: Self) -> Self {
        if mask == [true; LANES] {
            return then;
        }
        if mask == [false; LANES] {
            return otherwise;
        }
        let chosen = |then: Row, otherwise: Row| -> Row {
            from_fn(|lane| {
                if mask[lane] {
                    then[lane]
                } else {
                    otherwise[lane]
                }
            })
        };
        let value = chosen(then.value, otherwise.value);
        let one = [1.0; LANES];
        let by_then = || Slope::Of(chosen(one, ZERO));
        then.follow(otherwise, value, by_then, || Slope::Of(chosen(ZERO, one)))
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

    /// Every function by both parameters, as dual numbers have it, at several points.
    #[test]
    fn backwards_is_forwards() {
        let tape = RefCell::new(Operations {
            parameters: 2,
            ..Operations::default()
        });
        let time = Taped {
            tape: Some(&tape),
            ..Taped::from_f64(0.0)
        };
        // Choices are of each point its own.
        let x_of = |lane: usize| 0.37 + 0.06 * lane as f64;
        let (x, y) = (time.parameter(0, 0.37), time.parameter(1, 0.61));
        let along = Taped::of(from_fn(|lane| x_of(lane) - 0.37));
        let results = values(x + along, y);
        let operations = tape.borrow();
        for (at, (name, result)) in results.iter().enumerate() {
            let mut adjoints = vec![ZERO; 2 + operations.list.len()];
            adjoints[result.place as usize] = [1.0; LANES];
            read_backwards(&operations, &mut adjoints);
            for lane in 0..LANES {
                let x = x_of(lane);
                let by_x = values(Dual::new(x, 1.0), Dual::new(0.61, 0.0))[at].1;
                let by_y = values(Dual::new(x, 0.0), Dual::new(0.61, 1.0))[at].1;
                let off = result.value[lane] - by_x.value;
                assert!(off.abs() <= 4e-15 * by_x.value.abs(), "{name}: {off}");
                for (sum, forwards) in [adjoints[0][lane], adjoints[1][lane]]
                    .iter()
                    .zip([by_x.slope, by_y.slope])
                {
                    let size = forwards.abs().max(1.0);
                    assert!(
                        (sum - forwards).abs() < 1e-14 * size,
                        "{name}: {sum} {forwards}"
                    );
                }
            }
        }
    }

    /// The derivative of a function by its one parameter.
    fn by_parameter(value: f64, function: impl for<'t> Fn(Taped<'t>) -> Taped<'t>) -> Row {
        let tape = RefCell::new(Operations {
            parameters: 1,
            ..Operations::default()
        });
        let time = Taped {
            tape: Some(&tape),
            ..Taped::from_f64(0.0)
        };
        let result = function(time.parameter(0, value));
        let operations = tape.borrow();
        let mut adjoints = vec![ZERO; 1 + operations.list.len()];
        adjoints[result.place as usize] = [1.0; LANES];
        read_backwards(&operations, &mut adjoints);
        adjoints[0]
    }

    /// As of dual numbers: powers that vanish, whose exponent is a parameter, and roots and lengths of zero that no parameter moves.
    #[test]
    fn what_vanishes_has_no_part() {
        let x = [0.0, 1.0, 4.0, 16.0];
        let by_exponent = by_parameter(1.5, |a| Taped::of(x).powf(a));
        let of_root = by_parameter(0.25, |a| (a * Taped::of(x)).sqrt());
        let of_length = by_parameter(0.25, |a| (a * Taped::of(x)).hypot(a * Taped::of(x)));
        assert_eq!(by_parameter(0.0, |a| a.hypot(Taped::of(ZERO))), ZERO);
        for lane in 0..LANES {
            // xᵃ ln x, ½ √(x/a) and √2 x
            let x: f64 = x[lane];
            let logarithm = if x == 0.0 { 0.0 } else { x.ln() };
            let expected = [
                x * x.sqrt() * logarithm,
                x.sqrt(),
                core::f64::consts::SQRT_2 * x,
            ];
            let found = [by_exponent[lane], of_root[lane], of_length[lane]];
            for (found, expected) in found.into_iter().zip(expected) {
                let off = (found - expected).abs();
                assert!(off <= 4.0 * f64::EPSILON * expected, "{found} {expected}");
            }
        }
    }

    /// As of dual numbers, to the last digit but a few.
    #[test]
    fn slopes_beside_one_have_all_digits() {
        let (below, above) = (1.0 - 1e-10, 1.0 + 1e-10);
        let slope = |x: f64, function: fn(Dual) -> Dual| function(Dual::new(x, 1.0)).slope;
        for (found, expected) in [
            (
                by_parameter(below, |x| -x.asin()),
                -slope(below, Real::asin),
            ),
            (
                by_parameter(below, |x| -x.acos()),
                -slope(below, Real::acos),
            ),
            (
                by_parameter(below, |x| -x.atanh()),
                -slope(below, Real::atanh),
            ),
            (
                by_parameter(above, |x| -x.acosh()),
                -slope(above, Real::acosh),
            ),
        ] {
            let off = (found[0] - expected).abs() / expected.abs();
            assert!(off < 4.0 * f64::EPSILON, "{off:e}");
        }
    }

    /// What is not chosen has no part, be its derivative infinite.
    #[test]
    fn what_is_not_chosen_has_no_part() {
        let tape = RefCell::new(Operations {
            parameters: 1,
            ..Operations::default()
        });
        let time = Taped {
            tape: Some(&tape),
            ..Taped::from_f64(0.0)
        };
        let x = time.parameter(0, 0.0) + Taped::of(from_fn(|lane| lane as f64));
        let root = Taped::select(x.less(Taped::from_f64(0.5)), x, x.sqrt());
        let operations = tape.borrow();
        let mut adjoints = vec![ZERO; 1 + operations.list.len()];
        adjoints[root.place as usize] = [1.0; LANES];
        read_backwards(&operations, &mut adjoints);
        let expected: Row = from_fn(|lane| match lane {
            0 => 1.0,
            _ => 0.5 / (lane as f64).sqrt(),
        });
        assert_eq!(adjoints[0], expected);
    }
}
