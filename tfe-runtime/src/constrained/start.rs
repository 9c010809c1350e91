//! The violation of constraints by a start, relative to the size of the terms of each constraint.

use super::residual::over;
use super::rows::{Constrains, Rows, norm, rows_len};
use super::states::{Residual, residuals_of};
use crate::control::START_TOLERANCE;
use crate::enclosure::Enclosure;
use crate::model::Model;
use alloc::vec;
use alloc::vec::Vec;

/// The relative rounding error that each number of a consistent start may have: iterations accept increments of
/// positions of this size as rounding errors.
const ROUNDINGS: f64 = crate::control::POSITION_ROUND_OFF;

/// As [`residuals`](super::residuals), for a start: the violation of a holonomic constraint is also compared with the
/// size of its own terms, and the larger relative violation counts (T-165).
///
/// Relative to the extent of all positions, a unit quaternion or a rod of one metre beside x = 1.5e11 m would be accepted
/// with any error. With the gradient A, the second derivatives φ_qq, and the size of the terms of φ from an enclosure of
/// its formula, the scales are
///
/// ```text
/// S = Σ_j |A_j| min(|q|, |A| / |φ_qq,j|) + terms   for |φ| ,     max(|A| |v| + |a|, S/h)   for |A v + a| ,
/// ```
///
/// where v has only the coordinates of this constraint. The effect of rounding errors of the start is subtracted first.
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
    let exactly = |x: f64| Enclosure::between(x, x);
    let mut bounds = vec![Enclosure::ZERO; M::CONSTRAINTS.len()];
    model.constraint_values(exactly(t), &q.map(exactly), &mut bounds);
    beside_own(model, (t, h), (q, v), &bounds)
}

fn beside_own<const N: usize>(
    model: &dyn Constrains<N>,
    (t, h): (f64, f64),
    (q, v): (&[f64; N], &[f64; N]),
    bounds: &[Enclosure],
) -> Vec<Residual> {
    let declared = model.declared();
    let mut residuals = residuals_of(model, t, (q, v), h);
    let mut memory = vec![0.0; rows_len(N, declared.len())];
    let mut rows = Rows::of(&mut memory, declared.len());
    rows.evaluate(model, t, q);
    for (c, residual) in residuals.iter_mut().enumerate() {
        if !declared[c].kind.is_holonomic() {
            continue;
        }
        // The enclosure of a sum is wider than its value by the rounding errors of its terms. An infinite one says nothing
        // of them, and nothing is refused.
        let terms = (bounds[c].high() - bounds[c].low()) / f64::EPSILON;
        let (position, velocity) = of_row(&mut rows, model, c, (t, h), (q, v), terms);
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

/// |φ| and |A v + a| of one constraint, relative to the size of its terms; zeros if they are small relative to these
/// terms alone.
fn of_row<const N: usize>(
    rows: &mut Rows<'_, N>,
    model: &dyn Constrains<N>,
    c: usize,
    (t, h): (f64, f64),
    (q, v): (&[f64; N], &[f64; N]),
    terms: f64,
) -> (f64, f64) {
    let row = rows.rows[c];
    let (length, extent, drift) = (norm(&row), norm(q), rows.drift[c].abs());
    if length == 0.0 || !(terms + length + extent).is_finite() {
        return (0.0, 0.0);
    }
    let sum = |of: &[f64; N]| -> f64 { row.iter().zip(of).map(|(a, x)| (a * x).abs()).sum() };
    let rounded = ROUNDINGS * (sum(q) + drift * t.abs());
    let phi = (rows.values[c].abs() - rounded).max(0.0);
    let psi = (rows.psi(c, v).abs() - ROUNDINGS * length * norm(v)).max(0.0);
    let speeds = (sum(v) + drift).max(terms / h.abs());
    if phi <= START_TOLERANCE * terms && psi <= START_TOLERANCE * speeds {
        return (0.0, 0.0);
    }
    rows.mu.fill(0.0);
    rows.mu[c] = 1.0;
    let curvature = rows.differentiate(model, t, q, v).bend;
    let turned: f64 = (rows.psi_q[c].iter().zip(q))
        .map(|(by, q)| (by * q).abs())
        .sum();
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
