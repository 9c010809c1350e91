//! Models of fixed size with given inputs.

use super::Driven;
use std::array;
use tfe_runtime::{
    By, Constraint, ConstraintSecond, Controlled, CoordinateName, Facts, First, Form, InputFailure,
    InputPanicked, MAX_INPUTS, Model, ModelError, Real, Second,
};

/// The time step of difference quotients along the rates of the inputs. Within it, an input moves by that fraction of
/// its size (at least one) for which the truncation error of second order equals the rounding error.
fn distance<R: Real>(inputs: &[R; MAX_INPUTS], rates: &[R; MAX_INPUTS], t: R) -> R {
    const PART: f64 = 6e-6;
    let mut fastest = t.like(f64::MIN_POSITIVE);
    for (input, rate) in inputs.iter().zip(rates) {
        let size = input.abs().max(t.like(1.0));
        fastest = fastest.max(rate.abs() / size);
    }
    t.like(PART) / fastest
}

impl<M: Controlled<N>, const N: usize> Model<N> for Driven<'_, M> {
    /// Catches a panic of an input function. The guard surrounds a whole step, so that single calls cost nothing; after
    /// a panic the caller discards what is incomplete.
    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Result<T, InputPanicked> {
        self.sources.guarded(f)
    }

    fn failed_input(&self) -> Option<InputFailure> {
        self.sources.failure(M::INPUTS)
    }

    fn breaks_of_inputs<F: FnMut(f64)>(&self, report: &mut F) {
        self.sources.times_of_tables().for_each(report);
    }

    const FORM: Form = M::FORM;
    const FACTS: Facts = Facts {
        time_dependent: true,
        ..M::FACTS
    };

    fn check(&self) -> Result<(), ModelError> {
        self.model.check()
    }

    fn energy_function<R: Real>(&self, t: R, q: &[R; N], z: &[R; N]) -> R {
        self.model
            .energy_function_with(&self.sources.values(t), t, q, z)
    }

    const IGNORABLE: [bool; N] = M::IGNORABLE;
    const DIAGONAL_MASS: bool = M::DIAGONAL_MASS;
    const LANES: bool = M::LANES;

    #[inline(always)]
    fn first_inline<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.model
            .first_with(&self.sources.values(t), t, q, z, first);
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
        let inputs = self.sources.values(t);
        self.model.first_and_mass_with(&inputs, t, q, z, first, zz);
    }

    fn first<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        self.first_inline(t, q, z, first);
    }

    fn first_and_mass<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        zz: &mut [[R; N]; N],
    ) {
        self.first_and_mass_inline(t, q, z, first, zz);
    }

    fn second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        z: &[R; N],
        first: &mut First<R, N>,
        second: &mut Second<R, N>,
    ) {
        let inputs = self.sources.values(t);
        self.model.second_with(&inputs, t, q, z, first, second);
    }

    const GIVEN_INPUTS: bool = true;

    fn shares_inputs(&self, other: &Self) -> bool {
        self.sources.are_those_of(&other.sources)
    }

    const SENSITIVITIES: &'static [&'static str] = M::SENSITIVITIES;

    fn sensitivity_parameter(&self, index: usize) -> f64 {
        self.model.sensitivity_parameter(index)
    }

    /// The time derivatives include those at fixed inputs. If an input is a function or a table, difference quotients
    /// along the rates of the inputs are added, with steps of about 1e-5 of their size; their relative error is about
    /// 1e-10.
    fn first_by<R: Real>(&self, by: By, t: R, q: &[R; N], z: &[R; N], first: &mut First<R, N>) {
        let inputs = self.sources.values(t);
        if by != By::Time || self.sources.is_constant() {
            return self.model.first_by_with(by, &inputs, t, q, z, first);
        }
        let (mut fixed, mut before, mut after) = (First::zero(), First::zero(), First::zero());
        self.model.first_by_with(by, &inputs, t, q, z, &mut fixed);
        let rates = self.sources.rates(t);
        let distance = distance(&inputs, &rates, t);
        // An input at another time may lie beyond a jump, so it is extrapolated by its rate.
        let moved = |by: R| -> [R; MAX_INPUTS] { array::from_fn(|k| inputs[k] + by * rates[k]) };
        self.model
            .first_with(&moved(-distance), t, q, z, &mut before);
        self.model.first_with(&moved(distance), t, q, z, &mut after);
        let rate = |before: R, after: R| (after - before) / (distance + distance);
        for a in 0..N {
            first.z[a] = fixed.z[a] + rate(before.z[a], after.z[a]);
            first.q[a] = fixed.q[a] + rate(before.q[a], after.q[a]);
            first.force[a] = fixed.force[a] + rate(before.force[a], after.force[a]);
        }
    }

    fn unnumbered<F: FnMut(u64)>(&self, values: &mut F) {
        self.model.unnumbered(values);
    }

    fn parameters(&self) -> usize {
        self.model.parameters()
    }

    fn parameter_name(&self, index: usize) -> CoordinateName {
        self.model.parameter_name(index)
    }

    fn parameter(&self, index: usize) -> f64 {
        self.model.parameter(index)
    }

    fn with_parameter(&self, index: usize, value: f64) -> Option<Self> {
        Some(self.of(self.model.with_parameter(index, value)?))
    }

    const CONSTRAINTS: &'static [Constraint] = M::CONSTRAINTS;

    fn constraint_values<R: Real>(&self, t: R, q: &[R; N], values: &mut [R]) {
        self.model.constraint_values(t, q, values);
    }

    fn constraint_rows<R: Real>(&self, t: R, q: &[R; N], rows: &mut [[R; N]], drift: &mut [R]) {
        self.model.constraint_rows(t, q, rows, drift);
    }

    fn constraint_second<R: Real>(
        &self,
        t: R,
        q: &[R; N],
        v: &[R; N],
        mu: &[R],
        second: &mut ConstraintSecond<'_, R, N>,
    ) {
        self.model.constraint_second(t, q, v, mu, second);
    }

    fn coordinate_name(index: usize) -> CoordinateName {
        M::coordinate_name(index)
    }

    const OBSERVABLES: &'static [&'static str] = M::OBSERVABLES;

    fn columns(&self) -> usize {
        self.model.columns()
    }

    fn column_name(&self, column: usize) -> CoordinateName {
        self.model.column_name(column)
    }

    fn observables<R: Real>(&self, t: R, q: &[R; N], z: &[R; N], values: &mut [R]) {
        let inputs = self.sources.values(t);
        self.model.observables_with(&inputs, t, q, z, values);
    }
}
