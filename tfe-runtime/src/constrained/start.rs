//! The violation of constraints by a state, relative to the size of the terms of each constraint.

use super::constrains::Constrains;
use super::residual::over;
use super::rows::{Rows, norm, rows_len};
use super::states::{Residual, residuals_of};
use crate::control::START_TOLERANCE;
use crate::enclosure::Enclosure;
use crate::model::Model;
use alloc::vec;
use alloc::vec::Vec;

/// The relative rounding error that each number of a consistent start may have: iterations accept increments of
/// positions of this size as rounding errors.
const ROUNDINGS: f64 = crate::control::POSITION_ROUND_OFF;

/// What violations are compared with besides the terms of each constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// The length of a time, such as a step.
    pub h: f64,
    /// How far all positions reach.
    pub extent: f64,
    /// The error that iterations were allowed to leave, relative to all positions and velocities.
    pub tolerance: f64,
}

/// The larger one of the violations of each constraint relative to all positions and to its own terms.
pub(super) fn start_residuals_of<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    (q, v): (&[f64; N], &[f64; N]),
    h: f64,
) -> Vec<Residual> {
    let mut residuals = residuals_of(model, t, (q, v), h);
    let scales = Scales {
        h,
        extent: norm(q),
        tolerance: 0.0,
    };
    let own = own_residuals_of(model, t, (q, v), scales);
    for (residual, (position, velocity)) in residuals.iter_mut().zip(own) {
        // NaN stays NaN.
        if position > residual.relative_position {
            residual.relative_position = position;
        }
        if velocity > residual.relative_velocity {
            residual.relative_velocity = velocity;
        }
    }
    residuals
}

/// The violation of each constraint relative to the size of its own terms, by positions and by velocities (T-165).
/// Zeros for constraints on velocities.
///
/// Relative to the extent of all positions, a unit quaternion or a rod of one metre beside x = 1.5e11 m would be
/// accepted with any error. With the gradient A, the second derivatives φ_qq, and the size of the terms of φ from an
/// enclosure of its formula, the scales are
///
/// ```text
/// S = Σ_j |A_j| min(|q|, |A| / |φ_qq,j|) + terms   for |φ| ,     max(|A| |v| + |a|, S/h)   for |A v + a| ,
/// ```
///
/// where v has only the coordinates of this constraint, and |q| is the extent of all positions. The effect of rounding
/// errors, and of the tolerance of iterations, is subtracted first.
#[must_use]
pub fn own_residuals<M, const N: usize>(
    model: &M,
    t: f64,
    (q, v): (&[f64; N], &[f64; N]),
    scales: Scales,
) -> Vec<(f64, f64)>
where
    M: Model<N>,
{
    own_residuals_of(model, t, (q, v), scales)
}

fn own_residuals_of<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    at: (&[f64; N], &[f64; N]),
    scales: Scales,
) -> Vec<(f64, f64)> {
    let mut bounds = vec![Enclosure::ZERO; model.declared().len()];
    model.bounds_at(t, at.0, &mut bounds);
    beside_own(model, t, at, scales, &bounds)
}

/// The first holonomic constraint that is violated by more than a start may, relative to the size of its own terms:
/// whether by positions, and the relative violation. The rows have been evaluated; if they are the declared ones, they
/// tell at little cost that nothing is violated.
pub(crate) fn violated<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    (q, v): (&[f64; N], &[f64; N]),
    scales: Scales,
    rows: Option<&Rows<'_, N>>,
) -> Option<(usize, bool, f64)> {
    let is_suspect = |rows: &Rows<'_, N>| {
        (model.declared().iter().enumerate()).any(|(c, constraint)| {
            constraint.kind.is_holonomic() && {
                let (phi, psi) = beyond_roundings(rows, c, t, (q, v), scales);
                phi > 0.0 || psi > 0.0
            }
        })
    };
    match rows.is_none_or(is_suspect) {
        true => first_violated(model, t, (q, v), scales),
        false => None,
    }
}

#[cold]
#[inline(never)]
fn first_violated<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    at: (&[f64; N], &[f64; N]),
    scales: Scales,
) -> Option<(usize, bool, f64)> {
    let own = own_residuals_of(model, t, at, scales)
        .into_iter()
        .enumerate();
    let mut parts = own.flat_map(|(c, (position, velocity))| {
        let (position, velocity) = ((c, true, position), (c, false, velocity));
        [position, velocity]
    });
    parts.find(|(.., part)| *part > START_TOLERANCE)
}

fn beside_own<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    at: (&[f64; N], &[f64; N]),
    scales: Scales,
    bounds: &[Enclosure],
) -> Vec<(f64, f64)> {
    let declared = model.declared();
    let mut memory = vec![0.0; rows_len(N, declared.len())];
    let mut rows = Rows::of(&mut memory, declared.len());
    rows.evaluate(model, t, at.0);
    let of = |(c, bounds): (usize, &Enclosure)| {
        if !declared[c].kind.is_holonomic() {
            return (0.0, 0.0);
        }
        // The enclosure of a sum is wider than its value by the rounding errors of its terms. An infinite one says
        // nothing of them, and nothing is refused.
        let terms = (bounds.high() - bounds.low()) / f64::EPSILON;
        of_row(&mut rows, model, c, t, at, scales, terms)
    };
    bounds.iter().enumerate().map(of).collect()
}

/// |φ| and |A v + a| of one constraint that has been evaluated, less what rounding errors and iterations may leave.
fn beyond_roundings<const N: usize>(
    rows: &Rows<'_, N>,
    c: usize,
    t: f64,
    (q, v): (&[f64; N], &[f64; N]),
    scales: Scales,
) -> (f64, f64) {
    let (row, drift) = (&rows.rows[c], rows.drift[c].abs());
    let length = norm(row);
    let rounded = ROUNDINGS * (sum_of_terms(row, q) + drift * t.abs());
    let left = scales.tolerance * length * scales.extent;
    let part = ROUNDINGS + scales.tolerance;
    (
        (rows.values[c].abs() - rounded - left).max(0.0),
        (rows.psi(c, v).abs() - part * length * norm(v)).max(0.0),
    )
}

/// Σ |a_j x_j|
fn sum_of_terms<const N: usize>(row: &[f64; N], of: &[f64; N]) -> f64 {
    row.iter().zip(of).map(|(a, x)| (a * x).abs()).sum()
}

/// |φ| and |A v + a| of one constraint, relative to the size of its terms; zeros if they are small relative to these
/// terms alone.
fn of_row<const N: usize>(
    rows: &mut Rows<'_, N>,
    model: &dyn Constrains<N>,
    c: usize,
    t: f64,
    (q, v): (&[f64; N], &[f64; N]),
    scales: Scales,
    terms: f64,
) -> (f64, f64) {
    let (row, h) = (rows.rows[c], scales.h);
    let (length, extent, drift) = (norm(&row), scales.extent, rows.drift[c].abs());
    if length == 0.0 || !(terms + length + extent).is_finite() {
        return (0.0, 0.0);
    }
    let (phi, psi) = beyond_roundings(rows, c, t, (q, v), scales);
    let speeds = (sum_of_terms(&row, v) + drift).max(terms / h.abs());
    if phi <= START_TOLERANCE * terms && psi <= START_TOLERANCE * speeds {
        return (0.0, 0.0);
    }
    rows.mu.fill(0.0);
    rows.mu[c] = 1.0;
    let curvature = rows.differentiate(model, t, q, v).bend;
    let turned = sum_of_terms(&rows.psi_q[c], q);
    let (mut size, mut own) = (terms, [0.0; N]);
    for a in 0..N {
        let bent = norm(&curvature[a]);
        // The quotient is infinite or NaN if the coordinate appears only linearly: it counts as far as all positions
        // reach.
        size += row[a].abs() * (length / bent).min(extent);
        if row[a] != 0.0 || bent != 0.0 {
            own[a] = v[a];
        }
    }
    let psi = (psi - ROUNDINGS * turned).max(0.0);
    let speeds = (length * norm(&own) + drift).max(size / h.abs());
    (over(phi, size), over(psi, speeds))
}
