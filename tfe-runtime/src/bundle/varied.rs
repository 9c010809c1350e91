//! Models that differ in their parameters, side by side.
//!
//! A kernel makes its parameters from its time argument ([`Real::parameter`]). Here this number holds eight values of
//! each parameter, so that lane k computes with those of model k, by the same kernel that serves a single model.

use super::together::{Together, Trajectories};
use crate::model::{CoordinateName, Facts, First, Form, Model, Second, State};
use crate::points::constant_rates;
use crate::precise::Precise;
use crate::real::Real;
use crate::registers::pair::{Eight, LANES, OutOfLine};
use crate::registers::side::Side;
use alloc::vec::Vec;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Up to eight models that differ only in their parameters, as one model for steps side by side.
#[derive(Debug)]
pub struct Varied<'m, M> {
    models: [&'m M; LANES],
    /// The value of every parameter in each lane.
    parameters: Vec<[f64; LANES]>,
}

// Not derived: the models are borrowed and need not be `Clone`.
impl<M> Clone for Varied<'_, M> {
    fn clone(&self) -> Self {
        Self {
            models: self.models,
            parameters: self.parameters.clone(),
        }
    }
}

impl<'m, M> Varied<'m, M> {
    /// The same model in all lanes.
    pub(super) fn new<const N: usize>(model: &'m M) -> Self
    where
        M: Model<N>,
    {
        let parameters = (0..model.parameters()).map(|index| [model.parameter(index); LANES]);
        Self {
            models: [model; LANES],
            parameters: parameters.collect(),
        }
    }

    /// Sets the models, one for each lane; lanes without a new model are unchanged, and models beyond the eighth are
    /// ignored.
    pub(super) fn set<const N: usize>(&mut self, models: &'m [M])
    where
        M: Model<N>,
    {
        for (lane, model) in models.iter().enumerate().take(LANES) {
            self.models[lane] = model;
            for (index, values) in self.parameters.iter_mut().enumerate() {
                values[lane] = model.parameter(index);
            }
        }
    }
}

impl<M: Model<N>, const N: usize> Together<N> for Varied<'_, M> {
    type Kernels = Self;
    type Number<'a, V: Eight>
        = Parametrised<'a, V>
    where
        Self: 'a;

    fn kernels(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn number<V: Eight>(&self, like: V) -> Parametrised<'_, V> {
        Parametrised {
            value: like,
            parameters: &self.parameters,
        }
    }

    fn constant_rates(&self, lane: usize, t: f64, start: &State<N>) -> ([f64; N], [f64; N]) {
        constant_rates(self.models[lane % LANES], t, start)
    }
}

impl<'m, M: Model<N>, const N: usize> Trajectories<'m, M, N> for Varied<'m, M> {
    fn model(&self, lane: usize) -> &'m M {
        self.models[lane % LANES]
    }
}

/// The kernels of the first model, which take their parameters from their time argument.
impl<M: Model<N>, const N: usize> Model<N> for Varied<'_, M> {
    const FORM: Form = M::FORM;
    const FACTS: Facts = Facts {
        // It is constant during a run, but differs between lanes.
        constant_mass: false,
        ..M::FACTS
    };
    const IGNORABLE: [bool; N] = M::IGNORABLE;
    const LANES: bool = M::LANES;

    fn energy_function<R: Real>(&self, t: R, q: &[R; N], z: &[R; N]) -> R {
        self.models[0].energy_function(t, q, z)
    }

    fn first<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.models[0].first(t, q, z, first);
    }

    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        self.models[0].first_and_mass(t, q, z, first, zz);
    }

    #[inline(always)]
    fn first_inline<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.models[0].first_inline(t, q, z, first);
    }

    #[inline(always)]
    fn first_and_mass_inline<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        self.models[0].first_and_mass_inline(t, q, z, first, zz);
    }

    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    ) {
        self.models[0].second(t, q, z, first, second);
    }

    fn coordinate_name(index: usize) -> CoordinateName {
        M::coordinate_name(index)
    }
}

/// Eight numbers with the parameters of eight models.
#[derive(Clone, Copy, Debug)]
pub struct Parametrised<'a, V> {
    value: V,
    parameters: &'a [[f64; LANES]],
}

impl<V> Parametrised<'_, V> {
    /// Another number with the same parameters.
    #[inline(always)]
    fn of(self, value: V) -> Self {
        Self { value, ..self }
    }
}

impl<V: Eight> Side<LANES> for Parametrised<'_, V> {
    #[inline(always)]
    fn with(self, lanes: [f64; LANES]) -> Self {
        Self {
            value: self.value.with(lanes),
            ..self
        }
    }

    #[inline(always)]
    fn lanes(self) -> [f64; LANES] {
        self.value.lanes()
    }
}

impl<V: Eight> Eight for Parametrised<'_, V> {
    #[inline(always)]
    fn any_positive(self) -> bool {
        self.value.any_positive()
    }

    /// The work does not depend on the model, and therefore needs no parameters.
    #[inline(always)]
    fn out_of_line<W: OutOfLine>(self, work: W) {
        self.value.out_of_line(work);
    }
}

impl<V: Eight> Precise for Parametrised<'_, V> {
    #[inline(always)]
    fn product(self, other: Self) -> (Self, Self) {
        let (high, low) = self.value.product(other.value);
        (self.of(high), self.of(low))
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, term: Self) -> Self {
        self.of(self.value.times_plus(factor.value, term.value))
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.of(self.value.larger(other.value))
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident;)*) => {$(
        impl<V: Real> $operator for Parametrised<'_, V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.of(self.value.$method(other.value))
            }
        }
    )*};
}
operators! { Add add; Sub sub; Mul mul; Div div; }

impl<V: Real> Neg for Parametrised<'_, V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.of(-self.value)
    }
}

impl<V: Real> AddAssign for Parametrised<'_, V> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.value += other.value;
    }
}

impl<V: Real> SubAssign for Parametrised<'_, V> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        self.value -= other.value;
    }
}

macro_rules! of_values {
    ($($name:ident($($argument:ident)?);)*) => {$(
        #[inline(always)]
        fn $name(self $(, $argument: Self)?) -> Self {
            self.of(self.value.$name($($argument.value)?))
        }
    )*};
}

impl<V: Eight> Real for Parametrised<'_, V> {
    type Mask = V::Mask;

    /// A number without parameters: kernels make their constants by [`like`](Real::like).
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self {
            value: V::from_f64(value),
            parameters: &[],
        }
    }

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        self.of(self.value.like(value))
    }

    #[inline(always)]
    fn parameter(self, index: usize, _value: f64) -> Self {
        match self.parameters.get(index) {
            Some(values) => self.with(*values),
            None => self.like(f64::NAN),
        }
    }

    fn map(self, function: &mut dyn FnMut(f64) -> f64) -> Self {
        self.of(self.value.map(function))
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.of(sin), self.of(cos))
    }

    of_values! {
        sin(); cos(); tan(); asin(); acos(); atan(); atan2(x); sinh(); cosh(); tanh(); asinh(); acosh(); atanh(); exp(); ln();
        hypot(other); powf(exponent); sign(); min(other); max(other); sqrt(); abs();
    }

    #[inline(always)]
    fn powi(self, exponent: i32) -> Self {
        self.of(self.value.powi(exponent))
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self::Mask {
        self.value.less(other.value)
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> Self::Mask {
        self.value.less_or_equal(other.value)
    }

    #[inline(always)]
    fn select(mask: Self::Mask, then: Self, otherwise: Self) -> Self {
        then.of(V::select(mask, then.value, otherwise.value))
    }
}
