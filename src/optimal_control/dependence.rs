//! Finds the outputs that depend on an input, by evaluating the kernels with numbers that only track this dependence.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use tfe_runtime::{Controlled, MAX_INPUTS, Real};

/// Whether a number was computed from the input in question, whatever its value.
#[derive(Clone, Copy, Debug)]
struct Depends(bool);

/// For each output, whether it depends on an input. This is also found where the derivative vanishes, as for u dx/dt at
/// rest.
pub(super) fn holding<M: Controlled<N>, const N: usize>(model: &M, input: usize) -> Vec<bool> {
    let none = Depends(false);
    let mut inputs = [none; MAX_INPUTS];
    inputs[input] = Depends(true);
    let mut values = vec![none; model.columns()];
    model.observables_with(&inputs, none, &[none; N], &[none; N], &mut values);
    values.into_iter().map(|value| value.0).collect()
}

impl Depends {
    fn or(self, other: Self) -> Self {
        Self(self.0 || other.0)
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl $operator for Depends {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                self.or(other)
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl AddAssign for Depends {
    fn add_assign(&mut self, other: Self) {
        *self = self.or(other);
    }
}

impl SubAssign for Depends {
    fn sub_assign(&mut self, other: Self) {
        *self = self.or(other);
    }
}

impl Neg for Depends {
    type Output = Self;
    fn neg(self) -> Self {
        self
    }
}

macro_rules! of_one {
    ($($function:ident),*) => {$(
        fn $function(self) -> Self {
            self
        }
    )*};
}

macro_rules! of_two {
    ($($function:ident),*) => {$(
        fn $function(self, other: Self) -> Self {
            self.or(other)
        }
    )*};
}

impl Real for Depends {
    /// Whether a compared number depends on the input.
    type Mask = bool;

    fn from_f64(_: f64) -> Self {
        Self(false)
    }
    of_one!(
        sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, asinh, acosh, atanh, exp, ln, sqrt, abs,
        sign
    );
    of_two!(atan2, min, max, hypot, powf);
    fn sin_cos(self) -> (Self, Self) {
        (self, self)
    }
    fn powi(self, _: i32) -> Self {
        self
    }
    fn less(self, other: Self) -> bool {
        self.or(other).0
    }
    fn less_or_equal(self, other: Self) -> bool {
        self.or(other).0
    }
    fn select(mask: bool, then: Self, otherwise: Self) -> Self {
        Self(mask || then.0 || otherwise.0)
    }
    fn map(self, _: &mut dyn FnMut(f64) -> f64) -> Self {
        self
    }
}
