//! Models with other parameters.

use crate::length::Length;
use tfe_runtime::{Model, Share, family};

/// A model with other parameters, and these by their numbers.
pub(in crate::simulation) type Changed<'m, M, const N: usize, L> =
    (<L as Length<N>>::Held<'m, M>, Vec<(usize, f64)>);

/// Makes a model with other values of some parameters, if that can be.
pub(in crate::simulation) type Remodel<'m, M, const N: usize, L> =
    fn(&M, &[(usize, f64)]) -> Option<<L as Length<N>>::Held<'m, M>>;

/// The [`Remodel`] of a model that may go to other threads.
pub(in crate::simulation) fn remodel<'m, M, const N: usize>(
    model: &M,
    values: &[(usize, f64)],
) -> Option<Share<'m, M>>
where
    M: Model<N> + Send + Sync + 'm,
{
    let ((first, value), others) = values.split_first()?;
    let mut made = model.with_parameter(*first, *value)?;
    for (index, value) in others {
        made = made.with_parameter(*index, *value)?;
    }
    Some(Share::own(made))
}

/// The same of a model of run-time length.
pub(in crate::simulation) fn remodel_long<'m, M>(
    model: &M,
    values: &[(usize, f64)],
) -> Option<Share<'m, M>>
where
    M: family::Model + Send + Sync + 'm,
{
    let ((first, value), others) = values.split_first()?;
    let mut made = model.with_parameter(*first, *value)?;
    for (index, value) in others {
        made = made.with_parameter(*index, *value)?;
    }
    Some(Share::own(made))
}
