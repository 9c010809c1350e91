//! What events, their actions and their derivatives ask of a model, without its type: they are compiled once for a
//! number of coordinates, and not for every model.

use super::remodel::changed;
use crate::error::RunErrorKind;
use crate::evaluate::Evaluate;
use crate::length::Length;
use crate::simulation::kind::Simulated;
use tfe_runtime::CoordinateName;
use tfe_runtime::dual::Dual;

/// A model whose type is unknown; implemented for every [`Simulated`] model, with its methods of the same names.
pub(in crate::simulation) trait EventModel<const N: usize, L: Length<N>> {
    /// Whether outputs need the velocity; for a Hamiltonian they are functions of the momentum.
    fn needs_velocity(&self) -> bool;

    fn is_constrained(&self) -> bool;

    fn output_count(&self) -> usize;

    fn outputs(
        &self,
        t: f64,
        at: (&L::Vector, &L::Vector),
        velocity: &L::Vector,
        values: &mut [f64],
    );

    fn outputs_towards(
        &self,
        t: Dual<f64>,
        q: (&L::Vector, &L::Vector),
        z: (&L::Vector, &L::Vector),
        values: &mut [Dual<f64>],
    );

    fn velocity(&self, t: f64, state: &L::State, guess: &L::Vector) -> Option<L::Vector>;

    fn allowed_velocity(&self, t: f64, state: &L::State, guess: &L::Vector) -> Option<L::Vector>;

    fn momenta(&self, t: f64, q: &L::Vector, v: &L::Vector) -> L::Vector;

    fn momenta_by(
        &self,
        t: f64,
        q: &L::Vector,
        second: (&L::Vector, &L::Vector),
        number: usize,
    ) -> L::Vector;

    fn parameter_names(&self) -> Vec<CoordinateName>;

    fn parameter_value(&self, number: usize) -> f64;

    /// The same model with other values of some parameters, if its parameters can be set.
    fn with_values<'a>(&'a self, values: &[(usize, f64)])
    -> Option<Box<dyn EventModel<N, L> + 'a>>;

    /// Refuses a state that does not fit the model.
    fn check_start(&self, start: &L::State) -> Result<(), RunErrorKind>;

    fn check_restart(&self, t: f64, h: f64, state: &L::State) -> Result<(), RunErrorKind>;
}

impl<M, const N: usize, L> EventModel<N, L> for M
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    fn needs_velocity(&self) -> bool {
        M::NEEDS_VELOCITY
    }

    fn is_constrained(&self) -> bool {
        M::IS_CONSTRAINED
    }

    fn output_count(&self) -> usize {
        Simulated::output_count(self)
    }

    fn outputs(
        &self,
        t: f64,
        at: (&L::Vector, &L::Vector),
        velocity: &L::Vector,
        values: &mut [f64],
    ) {
        Evaluate::outputs(self, t, at, velocity, values);
    }

    fn outputs_towards(
        &self,
        t: Dual<f64>,
        q: (&L::Vector, &L::Vector),
        z: (&L::Vector, &L::Vector),
        values: &mut [Dual<f64>],
    ) {
        Simulated::outputs_towards(self, t, q, z, values);
    }

    fn velocity(&self, t: f64, state: &L::State, guess: &L::Vector) -> Option<L::Vector> {
        Evaluate::velocity(self, t, state, guess)
    }

    fn allowed_velocity(&self, t: f64, state: &L::State, guess: &L::Vector) -> Option<L::Vector> {
        Simulated::allowed_velocity(self, t, state, guess)
    }

    fn momenta(&self, t: f64, q: &L::Vector, v: &L::Vector) -> L::Vector {
        Simulated::momenta(self, t, q, v)
    }

    fn momenta_by(
        &self,
        t: f64,
        q: &L::Vector,
        second: (&L::Vector, &L::Vector),
        number: usize,
    ) -> L::Vector {
        Simulated::momenta_by(self, t, q, second, number)
    }

    fn parameter_names(&self) -> Vec<CoordinateName> {
        Simulated::parameter_names(self)
    }

    fn parameter_value(&self, number: usize) -> f64 {
        Simulated::parameter_value(self, number)
    }

    fn with_values<'a>(
        &'a self,
        values: &[(usize, f64)],
    ) -> Option<Box<dyn EventModel<N, L> + 'a>> {
        Some(Box::new(changed(self, values)?))
    }

    fn check_start(&self, start: &L::State) -> Result<(), RunErrorKind> {
        Simulated::check_start(self, start, &[])
    }

    fn check_restart(&self, t: f64, h: f64, state: &L::State) -> Result<(), RunErrorKind> {
        Simulated::check_restart(self, t, h, state)
    }
}
