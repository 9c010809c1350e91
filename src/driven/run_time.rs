//! Models of run-time length with given inputs.

use super::Driven;
use crate::length::{Declared, RunTimeLength};
use tfe_runtime::family::{Controlled, Entries, Gradient, Model, ModelError, Sweep};
use tfe_runtime::{CoordinateName, Facts, Form, InputFailure, InputPanicked, Real};

impl<M: Controlled> Declared<0> for Driven<'_, M, RunTimeLength> {
    type Length = RunTimeLength;

    fn breaks<F: FnMut(f64)>(&self, report: &mut F) {
        self.sources.times_of_tables().for_each(report);
    }
}

impl<M: Controlled> Model for Driven<'_, M, RunTimeLength> {
    /// Catches a panic of an input function. The guard surrounds a whole step, so that single calls cost nothing; after
    /// a panic the caller discards what is incomplete.
    const GIVEN_INPUTS: bool = true;

    fn guarded<T>(&self, f: impl FnOnce() -> T) -> Result<T, InputPanicked> {
        self.sources.guarded(f)
    }

    fn failed_input(&self) -> Option<InputFailure> {
        self.sources.failure(M::INPUTS)
    }

    const FORM: Form = M::FORM;
    const FACTS: Facts = Facts {
        time_dependent: true,
        ..M::FACTS
    };
    const MOMENTA_MOVE: bool = M::MOMENTA_MOVE;
    const ASSIGNS: bool = M::ASSIGNS;

    fn len(&self) -> usize {
        self.model.len()
    }

    fn check(&self) -> Result<(), ModelError> {
        self.model.check()
    }

    fn energy_function<R: Real>(&self, t: R, q: &[R], z: &[R]) -> R {
        self.model
            .energy_function_with(&self.sources.values(t), t, q, z)
    }

    fn first<R: Real>(&self, t: R, q: &[R], z: &[R], first: Gradient<'_, R>) {
        self.model
            .first_with(&self.sources.values(t), t, q, z, first);
    }

    #[inline(always)]
    fn forces_inline<R: Real>(&self, t: R, q: &[R], z: &[R], first: Gradient<'_, R>) {
        self.model
            .forces_inline_with(&self.sources.values(t), t, q, z, first);
    }

    #[inline(always)]
    fn forces_in_strides<R: Real, S: Sweep<R>>(&self, t: R, sweep: &mut S) {
        self.model
            .forces_in_strides_with(&self.sources.values(t), t, sweep);
    }

    fn mass<R: Real, E: Entries<R>>(&self, t: R, q: &[R], z: &[R], entries: &mut E) {
        self.model
            .mass_with(&self.sources.values(t), t, q, z, entries);
    }

    fn second<R: Real, E: Entries<R>>(
        &self,
        t: R,
        q: &[R],
        z: &[R],
        first: Gradient<'_, R>,
        entries: &mut E,
    ) {
        self.model
            .second_with(&self.sources.values(t), t, q, z, first, entries);
    }

    fn coordinate_name(&self, index: usize) -> CoordinateName {
        self.model.coordinate_name(index)
    }

    const CONSTRAINED: bool = M::CONSTRAINED;

    fn constraints(&self) -> usize {
        self.model.constraints()
    }

    fn constraint_name(&self, row: usize) -> CoordinateName {
        self.model.constraint_name(row)
    }

    fn constraint_values<R: Real>(&self, t: R, q: &[R], values: &mut [R]) {
        self.model.constraint_values(t, q, values);
    }

    fn constraint_rows<R: Real, E: Entries<R>>(
        &self,
        t: R,
        q: &[R],
        drift: &mut [R],
        entries: &mut E,
    ) {
        self.model.constraint_rows(t, q, drift, entries);
    }

    fn constraint_second<R: Real, E: Entries<R>>(&self, t: R, q: &[R], mu: &[R], entries: &mut E) {
        self.model.constraint_second(t, q, mu, entries);
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

    const OBSERVABLES: &'static [&'static str] = M::OBSERVABLES;

    fn columns(&self) -> usize {
        self.model.columns()
    }

    fn column_name(&self, column: usize) -> CoordinateName {
        self.model.column_name(column)
    }

    fn observables<R: Real>(&self, t: R, q: &[R], z: &[R], values: &mut [R]) {
        let inputs = self.sources.values(t);
        self.model.observables_with(&inputs, t, q, z, values);
    }
}
