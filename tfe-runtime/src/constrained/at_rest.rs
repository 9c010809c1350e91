//! Mechanisms at rest at the origin of their coordinates: coordinates and velocities are rounding errors of the balance
//! of forces and reactions there, and numbers relative to them mean nothing. They are compared with what the reactions
//! alone would move (T-168).

use super::rows::Rows;
use crate::model::Model;
#[cfg(feature = "alloc")]
use {
    super::instant::{gradients, reactions},
    super::reach::{SparseRows, diagonal, forces, sparse, speeds},
    crate::control::ROUGH_ROUND_OFF,
    crate::legendre::{self, lagrangian_view_from, largest},
    alloc::vec::Vec,
};
#[cfg(feature = "std")]
use {
    super::rows::rows_len, super::start::start_residuals_of, super::states::Residual,
    crate::control::START_TOLERANCE, alloc::vec,
};

/// The entries of the rows, L_vv and the reactions at positions and velocities (T-77); `None` if there are none.
#[cfg(feature = "alloc")]
fn reactions_at<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
) -> Option<(SparseRows, [f64; N], Vec<f64>)>
where
    M: Model<N>,
{
    let state = legendre::state(model, t, q, v).ok()?;
    let found = reactions(model, t, &state, v).ok()?;
    let at = gradients(model, t, &state, v).ok()?;
    Some((sparse(&at.rows), diagonal(&at.second.zz), found))
}

/// The speeds of the reactions at positions and velocities in a time h; `None` if there are no reactions.
#[cfg(feature = "alloc")]
#[cold]
pub(super) fn speeds_at<M, const N: usize>(
    model: &M,
    (t, h): (f64, f64),
    q: &[f64; N],
    v: &[f64; N],
) -> Option<Vec<f64>>
where
    M: Model<N>,
{
    let (rows, masses, found) = reactions_at(model, t, q, v)?;
    Some(speeds(h, &masses, &rows, &found))
}

/// A bound of the rounding errors of forces that reactions balance: one of the largest force of constraints on a
/// coordinate. Zero without constraints.
#[cfg(feature = "alloc")]
#[cold]
pub fn reaction_rounding<M, const N: usize>(model: &M, t: f64, q: &[f64; N], v: &[f64; N]) -> f64
where
    M: Model<N>,
{
    if const { M::CONSTRAINTS.is_empty() } {
        return 0.0;
    }
    reactions_at(model, t, q, v).map_or(0.0, |(rows, _, found)| {
        f64::EPSILON * largest(&forces(&rows, &found, N))
    })
}

/// The work of the forces of a model along the rounding errors of what the reactions would move in a time h: so much
/// may its energy change at rest. Zero without constraints, and without memory for the reactions.
#[cold]
pub fn work_of_roundings<M, const N: usize>(
    model: &M,
    (t, h): (f64, f64),
    q: &[f64; N],
    v: &[f64; N],
) -> f64
where
    M: Model<N>,
{
    #[cfg(feature = "alloc")]
    if const { !M::CONSTRAINTS.is_empty() }
        && let Some(speeds) = speeds_at(model, (t, h), q, v)
        && let Ok(view) = lagrangian_view_from(model, t, q, v, &[0.0; N])
    {
        let works = view.first.q.iter().zip(&speeds);
        let works = works.map(|(force, speed)| (force * h * speed).abs());
        return ROUGH_ROUND_OFF * works.sum::<f64>();
    }
    let _ = (model, t, h, q, v);
    0.0
}

/// Whether φ and A v + a of a constraint that has been evaluated are rounding errors of what the reactions would move
/// in a time h, in its own coordinates. False without memory for the reactions.
#[cold]
pub(crate) fn is_rounding<M, const N: usize>(
    model: &M,
    (rows, c): (&Rows<'_, N>, usize),
    times: (f64, f64),
    (q, v): (&[f64; N], &[f64; N]),
) -> bool
where
    M: Model<N>,
{
    #[cfg(feature = "alloc")]
    if let Some(speeds) = speeds_at(model, times, q, v) {
        let products = rows.rows[c].iter().zip(&speeds);
        let reach: f64 = products.map(|(row, speed)| (row * speed).abs()).sum();
        let most = ROUGH_ROUND_OFF * reach;
        return rows.values[c].abs() <= most * times.1.abs() && rows.psi(c, v).abs() <= most;
    }
    let _ = (model, rows, c, times, q, v);
    false
}

/// As [`residuals`](super::residuals), for a start: the violation of a holonomic constraint is also compared with the
/// size of its own terms, and the larger relative violation counts (T-165); rounding errors of a mechanism at rest do
/// not (T-168).
#[cfg(feature = "std")]
#[must_use]
pub fn start_residuals<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
    h: f64,
) -> Vec<Residual>
where
    M: Model<N>,
{
    let mut residuals = start_residuals_of(model, t, (q, v), h);
    let is_refused = |residual: &Residual| residual.relative() > START_TOLERANCE;
    if residuals.iter().any(is_refused) {
        let mut memory = vec![0.0; rows_len(N, residuals.len())];
        let mut rows = Rows::of(&mut memory, residuals.len());
        rows.evaluate(model, t, q);
        for (c, residual) in residuals.iter_mut().enumerate() {
            if is_refused(residual) && is_rounding(model, (&rows, c), (t, h), (q, v)) {
                (residual.relative_position, residual.relative_velocity) = (0.0, 0.0);
            }
        }
    }
    residuals
}
