//! The equations of one orbit of a branch: those of a periodic orbit, with a parameter of the model as additional
//! unknown.

use super::arc::Row;
use crate::assembly::{ClosureMut, DenseMut, Iterate, Problem};
use crate::differences::derivative;
use crate::periodic::problem::{Periodic, energy_slopes};
use tfe_runtime::condenser::{Direction, Parameter};
use tfe_runtime::{LegendreError, Model};

/// Accesses the field of a model that is the parameter.
pub(super) type Field<'c, M> = dyn Fn(&mut M) -> &mut f64 + 'c;

/// The period as a function of the model.
pub(super) type PeriodOf<'c, M> = dyn Fn(&M) -> f64 + 'c;

/// A periodic orbit of a model whose parameter λ is the last of the global unknowns.
pub(super) struct Continued<'c, M, const N: usize> {
    /// The model at the current λ.
    pub(super) model: M,
    /// The orbit at the start of the branch, with the current period and unfolding.
    pub(super) orbit: Periodic<'c, M, N>,
    pub(super) field: &'c Field<'c, M>,
    /// The index of λ in [`Model::SENSITIVITIES`].
    pub(super) sensitivity: usize,
    /// T(λ), if it is given.
    pub(super) period: Option<&'c PeriodOf<'c, M>>,
    /// dT/dλ.
    pub(super) rate: f64,
    /// The length of the range of λ.
    pub(super) width: f64,
    /// The equation that fixes the point on the branch.
    pub(super) row: Row<N>,
}

impl<'c, M: Model<N> + Clone, const N: usize> Continued<'c, M, N> {
    /// The current λ.
    pub(super) fn parameter(&self) -> f64 {
        *(self.field)(&mut self.model.clone())
    }

    fn at(&self, parameter: f64) -> M {
        let mut model = self.model.clone();
        *(self.field)(&mut model) = parameter;
        model
    }

    /// The derivative of a number by λ. A small step is used, since the number may vary much within a small part of the
    /// range.
    fn difference(&self, value: impl Fn(&M) -> f64) -> f64 {
        let parameter = self.parameter();
        let distance = 1e-3 * parameter.abs().max(1e-2 * self.width);
        derivative(distance, |shift| value(&self.at(parameter + shift)))
    }
}

impl<M: Model<N> + Clone, const N: usize> Problem<N> for Continued<'_, M, N> {
    type Model = M;

    fn model(&self) -> &M {
        &self.model
    }

    fn place(&self, element: usize) -> (f64, f64) {
        self.orbit.place(element)
    }

    fn directions(&self, element: usize, directions: &mut [Direction]) {
        self.orbit.directions(element, directions);
        if let Some(direction) = directions.last_mut() {
            let stretched = self.orbit.mesh.stretched(element);
            *direction = Direction {
                time: self.rate * stretched.time,
                length: self.rate * stretched.length,
                parameter: Some(Parameter::Named(self.sensitivity)),
                damping: 0.0,
            };
        }
    }

    fn damping(&self) -> f64 {
        self.orbit.damping()
    }

    fn scale(&self, global: usize) -> f64 {
        if global < self.orbit.globals.len() {
            self.orbit.scale(global)
        } else {
            self.parameter().abs().max(1e-2 * self.width)
        }
    }

    fn set_globals(&mut self, globals: &[f64]) {
        self.orbit.set_globals(globals);
        if let Some(parameter) = globals.last() {
            *(self.field)(&mut self.model) = *parameter;
        }
        if let Some(period) = self.period {
            self.orbit.period = period(&self.model);
            self.rate = self.difference(period);
        }
    }

    fn close(&self, iterate: &Iterate<N>, closure: ClosureMut<'_>) -> Result<(), LegendreError> {
        let orbit = Periodic {
            model: &self.model,
            ..self.orbit.clone()
        };
        let reborrowed = ClosureMut {
            first: &mut *closure.first,
            last: &mut *closure.last,
            global: &mut *closure.global,
            right: &mut *closure.right,
        };
        orbit.close(iterate, reborrowed)?;
        if orbit.energy.is_none() {
            return Ok(());
        }
        // The energy is the last row, and the parameter the last column.
        if let (Some(entry), Some(first)) = (closure.global.last_mut(), iterate.nodes.first()) {
            *entry = self.difference(|model| {
                let found = energy_slopes(model, orbit.start, first);
                found.map_or(f64::NAN, |(energy, ..)| energy)
            });
        }
        Ok(())
    }

    fn span(&self, k: usize, iterate: &Iterate<N>, dense: DenseMut<'_>) {
        if k < self.orbit.dense() {
            let orbit = Periodic {
                model: &self.model,
                ..self.orbit.clone()
            };
            orbit.span(k, iterate, dense);
        } else {
            self.row.write(iterate, dense);
        }
    }
}
