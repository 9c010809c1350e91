//! Kinks and jumps of forces inside the elements of a mesh, which cannot end there.

use tfe_runtime::{Model, State, switching_functions};

/// The start of the first element at whose ends a switching function of the model has different signs.
pub(crate) fn crossed_kinks<M: Model<N>, const N: usize>(
    model: &M,
    nodes: impl Iterator<Item = (f64, State<N>)>,
) -> Option<f64> {
    if const { M::FACTS.smooth } {
        return None;
    }
    let mut last: Option<(f64, Vec<f64>)> = None;
    for (t, state) in nodes {
        let here = switching_functions(model, t, &state)?;
        if let Some((time, before)) = &last
            && before.iter().zip(&here).any(|(a, b)| a * b < 0.0)
        {
            return Some(*time);
        }
        last = Some((t, here));
    }
    None
}
