//! Changes parameters of a model during a run.

use crate::length::Length;
use crate::simulation::kind::Simulated;
use tfe_runtime::Share;

/// Creates a model with other values of some parameters, if its parameters can be set.
pub(in crate::simulation) type Remodel<'m, M> = fn(&M, &[(usize, f64)]) -> Option<Share<'m, M>>;

/// The [`Remodel`] of a model that can be shared between threads.
pub(in crate::simulation) fn remodel<'m, M, const N: usize, L>(
    model: &M,
    values: &[(usize, f64)],
) -> Option<Share<'m, M>>
where
    M: Simulated<N, L> + Send + Sync + 'm,
    L: Length<N>,
{
    changed(model, values).map(Share::own)
}

/// The same model with other values of some parameters.
pub(super) fn changed<M, const N: usize, L>(model: &M, values: &[(usize, f64)]) -> Option<M>
where
    M: Simulated<N, L>,
    L: Length<N>,
{
    let ((first, value), others) = values.split_first()?;
    let mut made = model.with_value(*first, *value)?;
    for (number, value) in others {
        made = made.with_value(*number, *value)?;
    }
    Some(made)
}
