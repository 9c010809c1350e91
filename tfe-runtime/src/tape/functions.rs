//! The functions of numbers that record their operations.

use super::number::Taped;
use super::operations::{LANES, Row, Slope, ZERO};
use crate::dual::below_one;
use crate::real::Real;
use core::array::from_fn;

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
        // x⁰ is constant: at zero its slope would be zero times infinity.
        let by_base = |x: f64, y: f64, _: f64| {
            if x == 0.0 && y == 0.0 {
                0.0
            } else {
                y * Real::powf(x, y - 1.0)
            }
        };
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
    use crate::tape::operations::{Operations, read_backwards};
    use alloc::vec;
    use core::cell::RefCell;

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

    /// As of dual numbers: powers that vanish, whose exponent is a parameter, and roots and lengths of zero that no
    /// parameter moves.
    #[test]
    fn what_vanishes_has_no_part() {
        let x = [0.0, 1.0, 4.0, 16.0];
        let by_exponent = by_parameter(1.5, |a| Taped::of(x).powf(a));
        let of_root = by_parameter(0.25, |a| (a * Taped::of(x)).sqrt());
        let of_length = by_parameter(0.25, |a| (a * Taped::of(x)).hypot(a * Taped::of(x)));
        assert_eq!(by_parameter(0.0, |a| a.hypot(Taped::of(ZERO))), ZERO);
        assert_eq!(by_parameter(0.0, |a| a.powf(Taped::of(ZERO))), ZERO);
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
