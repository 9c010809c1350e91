//! What steps models of either kind of length.

use crate::length::{FixedLength, Length, RunTimeLength};
use tfe_runtime::family::{FamilyModel, FamilyStepper};
use tfe_runtime::step::Stepper;
use tfe_runtime::{Model, Statistics};

/// A [`Length`] whose models of type M can be stepped.
pub trait Stepped<M, const N: usize>: Length<N> {
    /// What makes the steps.
    type Stepper<'m>
    where
        M: 'm;

    /// What the steps so far have cost.
    fn statistics<'s>(stepper: &'s Self::Stepper<'_>) -> &'s Statistics;
}

impl<M: Model<N>, const N: usize> Stepped<M, N> for FixedLength {
    type Stepper<'m>
        = Stepper<'m, M, N>
    where
        M: 'm;

    fn statistics<'s>(stepper: &'s Self::Stepper<'_>) -> &'s Statistics {
        stepper.statistics()
    }
}

impl<M: FamilyModel> Stepped<M, 0> for RunTimeLength {
    type Stepper<'m>
        = FamilyStepper<'m, M>
    where
        M: 'm;

    fn statistics<'s>(stepper: &'s Self::Stepper<'_>) -> &'s Statistics {
        stepper.statistics()
    }
}
