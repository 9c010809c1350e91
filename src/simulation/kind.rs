//! What steps models of either kind of length.

use crate::length::{FixedLength, Length, RunTimeLength};
use tfe_runtime::family::{FamilyModel, FamilyStepper};
use tfe_runtime::step::Stepper;
use tfe_runtime::{Model, Statistics};

/// A [`Length`] whose models of type M can be stepped.
pub trait Stepped<'m, M, const N: usize>: Length<N> {
    /// What makes the steps.
    type Stepper;

    /// What the steps so far have cost.
    fn statistics(stepper: &Self::Stepper) -> &Statistics;
}

impl<'m, M: Model<N> + 'm, const N: usize> Stepped<'m, M, N> for FixedLength {
    type Stepper = Stepper<'m, M, N>;

    fn statistics(stepper: &Self::Stepper) -> &Statistics {
        stepper.statistics()
    }
}

impl<'m, M: FamilyModel + 'm> Stepped<'m, M, 0> for RunTimeLength {
    type Stepper = FamilyStepper<'m, M>;

    fn statistics(stepper: &Self::Stepper) -> &Statistics {
        stepper.statistics()
    }
}
