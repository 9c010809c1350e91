//! Which kind of orbit `PeriodicOrbit::of` gives.

#[cfg(feature = "sparse")]
use super::family::FamilyPeriodicOrbit;
use super::setup::PeriodicOrbit;
use tfe_runtime::Model;
#[cfg(feature = "sparse")]
use tfe_runtime::family::FamilyModel;
#[cfg(feature = "sparse")]
use tfe_runtime::length::RunTimeLength;
use tfe_runtime::length::{Declared, FixedLength};

/// The kind of orbit that models of one kind of length have; what [`PeriodicOrbit::of`] returns.
#[cfg_attr(
    not(feature = "sparse"),
    diagnostic::on_unimplemented(
        message = "periodic orbits of models of run-time length need the feature `sparse`"
    )
)]
pub trait Orbits<M, const N: usize> {
    /// The orbit to be found.
    type Orbit<'m>
    where
        M: 'm;

    /// With the defaults.
    fn with_defaults(model: &M) -> Self::Orbit<'_>;
}

impl<M: Model<N>, const N: usize> Orbits<M, N> for FixedLength {
    type Orbit<'m>
        = PeriodicOrbit<'m, M, N>
    where
        M: 'm;

    fn with_defaults(model: &M) -> PeriodicOrbit<'_, M, N> {
        PeriodicOrbit::with_defaults(model)
    }
}

#[cfg(feature = "sparse")]
impl<M: FamilyModel> Orbits<M, 0> for RunTimeLength {
    type Orbit<'m>
        = FamilyPeriodicOrbit<'m, M>
    where
        M: 'm;

    fn with_defaults(model: &M) -> FamilyPeriodicOrbit<'_, M> {
        FamilyPeriodicOrbit::new(model)
    }
}

impl<'m, M, const N: usize> PeriodicOrbit<'m, M, N> {
    /// An orbit of `model`, with the defaults: this type for a model of fixed size, `FamilyPeriodicOrbit` (with the feature `sparse`) for one of
    /// run-time length, which has methods of the same names.
    pub fn of(model: &'m M) -> <M::Length as Orbits<M, N>>::Orbit<'m>
    where
        M: Declared<N, Length: Orbits<M, N>>,
    {
        M::Length::with_defaults(model)
    }
}
