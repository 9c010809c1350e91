//! Which kind of run `Simulation::new` gives.

use super::family::FamilySimulation;
use super::setup::Simulation;
use tfe_runtime::Model;
use tfe_runtime::family::FamilyModel;
use tfe_runtime::length::{Declared, FixedLength, RunTimeLength};

/// The kind of run that models of one kind of length have; what [`Simulation::new`] returns.
pub trait Runs<M, const N: usize> {
    /// The run to be.
    type Simulation<'m>
    where
        M: 'm;

    /// With the defaults.
    fn with_defaults(model: &M) -> Self::Simulation<'_>;
}

impl<M: Model<N>, const N: usize> Runs<M, N> for FixedLength {
    type Simulation<'m>
        = Simulation<'m, M, N>
    where
        M: 'm;

    fn with_defaults(model: &M) -> Simulation<'_, M, N> {
        Simulation::with_defaults(model)
    }
}

impl<M: FamilyModel> Runs<M, 0> for RunTimeLength {
    type Simulation<'m>
        = FamilySimulation<'m, M>
    where
        M: 'm;

    fn with_defaults(model: &M) -> FamilySimulation<'_, M> {
        FamilySimulation::new(model)
    }
}

impl<'m, M, const N: usize> Simulation<'m, M, N> {
    /// A run of `model` with the defaults: this type for a model of fixed size, [`FamilySimulation`](crate::family::FamilySimulation) for one of
    /// run-time length, which has methods of the same names.
    #[allow(
        clippy::new_ret_no_self,
        reason = "one name for models of both kinds of length"
    )]
    pub fn new(model: &'m M) -> <M::Length as Runs<M, N>>::Simulation<'m>
    where
        M: Declared<N, Length: Runs<M, N>>,
    {
        M::Length::with_defaults(model)
    }
}
