//! Mechanisms of run-time length at rest at the origin of their coordinates: numbers that are rounding errors of the
//! balance of forces and reactions are compared with what the reactions alone would move (T-168), as in
//! [`constrained::at_rest`](crate::constrained).

use super::inertia::masses;
use super::instant::Instant;
use super::model::{Gradient, Model};
use super::rows::Rows;
use crate::constrained::reach::{SparseRows, forces, speeds};
use crate::control::ROUGH_ROUND_OFF;
use crate::legendre::largest;
use alloc::vec;
use alloc::vec::Vec;

/// The entries of the rows that are not zero, with their coordinates.
pub(super) fn sparse(rows: &Rows) -> SparseRows {
    let mut sparse = vec![Vec::new(); rows.phi.len()];
    for ((constraint, a), value) in rows.places().zip(&rows.values) {
        if *value != 0.0 {
            sparse[constraint].push((a, *value));
        }
    }
    sparse
}

/// The entries of the rows, and the reactions, at positions and velocities (T-77); `None` if there are none.
fn reactions_at<M: Model>(
    model: &M,
    t: f64,
    q: &[f64],
    v: &[f64],
) -> Option<(SparseRows, Vec<f64>)> {
    let mut instant = Instant::new(model)?;
    let reactions = instant.reactions(model, (t, q), v).ok()?;
    Some((sparse(&instant.rows), reactions))
}

/// The speeds of the reactions at positions and velocities in a time h; `None` if there are no reactions.
#[cold]
fn speeds_at<M: Model>(model: &M, (t, h): (f64, f64), q: &[f64], v: &[f64]) -> Option<Vec<f64>> {
    let (rows, reactions) = reactions_at(model, t, q, v)?;
    Some(speeds(h, &masses(model, t, q, v), &rows, &reactions))
}

/// A bound of the rounding errors of forces that reactions balance: one of the largest force of constraints on a
/// coordinate. Zero without constraints.
#[cold]
pub(super) fn reaction_rounding<M: Model>(model: &M, t: f64, q: &[f64], v: &[f64]) -> f64 {
    if const { !M::CONSTRAINED } {
        return 0.0;
    }
    reactions_at(model, t, q, v).map_or(0.0, |(rows, reactions)| {
        f64::EPSILON * largest(&forces(&rows, &reactions, q.len()))
    })
}

/// The work of the forces of a model along the rounding errors of what the reactions would move in a time h. Zero
/// without constraints.
#[cold]
pub(super) fn work_of_roundings<M: Model>(
    model: &M,
    (t, h): (f64, f64),
    q: &[f64],
    v: &[f64],
) -> f64 {
    if const { !M::CONSTRAINED } {
        return 0.0;
    }
    let Some(speeds) = speeds_at(model, (t, h), q, v) else {
        return 0.0;
    };
    let [mut by_z, mut by_q, mut force] = [(); 3].map(|()| vec![0.0; q.len()]);
    let first = Gradient {
        z: &mut by_z,
        q: &mut by_q,
        force: &mut force,
    };
    model.first(t, q, v, first);
    let works = by_q
        .iter()
        .zip(&speeds)
        .map(|(force, speed)| (force * h * speed).abs());
    ROUGH_ROUND_OFF * works.sum::<f64>()
}

/// Whether φ, A v + a and the part `off` of the momenta that constraints do not allow are rounding errors of what the
/// reactions would move in a time h. The rows have been evaluated.
#[cold]
pub(super) fn are_roundings<M: Model>(
    model: &M,
    (t, h): (f64, f64),
    (q, v): (&[f64], &[f64]),
    rows: &Rows,
    off: &[f64],
) -> bool {
    let Some(speeds) = speeds_at(model, (t, h), q, v) else {
        return false;
    };
    let mut reaches = vec![0.0; rows.phi.len()];
    for ((constraint, a), value) in rows.places().zip(&rows.values) {
        reaches[constraint] += ROUGH_ROUND_OFF * (value * speeds[a]).abs();
    }
    let mut rates = vec![0.0; rows.phi.len()];
    rows.rate(v, &mut rates);
    let within = |numbers: &[f64], factor: f64| {
        let mut pairs = numbers.iter().zip(&reaches);
        pairs.all(|(number, reach)| number.abs() <= factor * reach)
    };
    let masses = masses(model, t, q, v);
    let mut momenta = off.iter().zip(masses.iter().zip(&speeds));
    within(&rows.phi, h.abs())
        && within(&rates, 1.0)
        && momenta.all(|(off, (mass, speed))| off.abs() <= ROUGH_ROUND_OFF * (mass * speed).abs())
}
