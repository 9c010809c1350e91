//! How far a start is from constraints, beside what each of them is made of.

use super::residual::over;
use super::rows::{Constrains, Rows, norm, rows_len};
use super::states::{Residual, residuals_of};
use crate::control::START_TOLERANCE;
use crate::enclosure::Enclosure;
use crate::model::Model;
use alloc::vec;
use alloc::vec::Vec;

/// By how much each number of a good start may be rounded: what an iteration takes for roundings of positions leaves no more.
const ROUNDINGS: f64 = crate::control::POSITION_ROUND_OFF;

/// As [`residuals`](super::residuals), for a start: a holonomic constraint is measured also beside what it is made of itself, and the larger part counts (T-165).
///
/// Beside x = 1.5e11 m a unit quaternion, or a rod of one metre, holds with any error as far as the extent of the positions tells. With the gradient A, the second derivatives
/// φ_qq and the terms of φ, which bounds of its formula tell,
///
/// ```text
/// |φ| beside S = Σ_j |A_j| min(|q|, |A| / |φ_qq,j|) + terms ,     |A v + a| beside max(|A| |v| + |a|, S/h) ,
/// ```
///
/// where v has the coordinates of this constraint only, and what roundings of the start make is taken off.
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
        // A sum whose bounds are so far apart has terms of that size; without bounds nothing is known of them, and nothing is refused.
        let terms = (bounds[c].high() - bounds[c].low()) / f64::EPSILON;
        let (position, velocity) = of_row(&mut rows, model, c, (t, h), (q, v), terms);
        // What is no number stays so.
        if position > residual.relative_position {
            residual.relative_position = position;
        }
        if velocity > residual.relative_velocity {
            residual.relative_velocity = velocity;
        }
    }
    residuals
}

/// |φ| and |A v + a| of one constraint, beside what it is made of; zeros where they are small beside its terms alone.
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
        // Infinite, or no number, where the coordinate is in no product: it counts as far as all positions reach.
        size += row[a].abs() * (length / bent).min(extent);
        if row[a] != 0.0 || bent != 0.0 {
            own[a] = v[a];
        }
    }
    let psi = (psi - ROUNDINGS * turned).max(0.0);
    let speeds = (length * norm(&own) + drift).max(size / h.abs());
    (over(phi, size), over(psi, speeds))
}
