//! What rounding errors of forces change of a state.

use crate::evaluate::Evaluate;
use crate::length::Length;
use crate::numbers::larger;

/// By how much coordinates and momenta may change in a time `h` due to rounding errors of forces.
pub(super) fn roundings<M, const N: usize, L>(
    model: &M,
    (t, h): (f64, f64),
    state: &L::State,
) -> (f64, f64)
where
    M: Evaluate<N, L>,
    L: Length<N>,
{
    /// The number of rounding errors of forces in an element.
    const MANY: f64 = 16.0;

    let (q, p) = L::parts(state);
    let Some(v) = model.velocity(t, state, &L::zero(p)) else {
        return (0.0, 0.0);
    };
    let impulse = MANY * (h * model.force_rounding(t, (q, p), &v)).abs();
    let kicked = L::state(q.clone(), L::from_fn(p, |a| p.as_ref()[a] + impulse));
    let Some(faster) = model.velocity(t, &kicked, &v) else {
        return (0.0, impulse);
    };
    let pairs = faster.as_ref().iter().zip(v.as_ref());
    let changes = pairs.map(|(faster, v)| (faster - v).abs());
    (h.abs() * changes.fold(0.0, larger), impulse)
}
