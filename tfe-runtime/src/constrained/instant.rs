//! Constraints at one instant of a motion: their reactions and their gradients.

use crate::constrained::constrains::Constrains;
use crate::constrained::derivative::{DualRows, explicit};
use crate::constrained::node::factor_bordered;
use crate::constrained::rows::{dot, norm, rows_len, scaled, scaled_norm};
use crate::constrained::states::chosen;
use crate::dual::{Dual, duals};
use crate::error::StepError;
use crate::legendre::{LagrangianView, lagrangian_view_from};
use crate::lu;
use crate::model::{Model, Second, State};
use alloc::vec;
use alloc::vec::Vec;

/// The derivatives of the constraints at a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradients<const N: usize> {
    /// A, a row for each constraint.
    pub rows: Vec<[f64; N]>,
    /// ∂(A v + a)/∂q, a row for each constraint.
    pub psi_q: Vec<[f64; N]>,
    /// Which constraints are independent.
    pub independent: Vec<bool>,
    /// L_vv, L_vq and the others.
    pub second: Second<f64, N>,
}

/// The derivatives of the constraints at positions and velocities.
///
/// # Errors
/// [`StepError`] if a Hamiltonian model has no momentum for the velocity.
pub fn gradients<M, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
    v: &[f64; N],
) -> Result<Gradients<N>, StepError>
where
    M: Model<N>,
{
    let second = lagrangian_view_from(model, t, &state.q, v, &state.p)?.second;
    Ok(gradients_with(second, model, (t, &state.q, v)))
}

fn gradients_with<const N: usize>(
    second: Second<f64, N>,
    model: &dyn Constrains<N>,
    (t, q, v): (f64, &[f64; N], &[f64; N]),
) -> Gradients<N> {
    let mut memory = vec![0.0; rows_len(N, model.declared().len())];
    let (mut rows, active) = chosen(model, (t, q), &mut memory);
    rows.differentiate(model, t, q, v);
    Gradients {
        rows: rows.rows.to_vec(),
        psi_q: rows.psi_q.to_vec(),
        independent: active.into_iter().map(|mark| mark != 0).collect(),
        second,
    }
}

/// The reactions λ of the constraints, one for each: the forces on the coordinates are Aᵀλ (T-77).
///
/// ```text
/// L_vv a + L_vq v + L_vt = L_q + Q + Aᵀλ ,     A a + d(A v + a)/dt|_v = 0
/// ```
///
/// Of dependent constraints any reactions with the same Aᵀλ would do; these have the least Σ λ².
///
/// # Errors
/// [`StepError`] if the kinetic energy is singular for motions that the constraints allow, or a value is not finite.
pub fn reactions<M, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
    v: &[f64; N],
) -> Result<Vec<f64>, StepError>
where
    M: Model<N>,
{
    let view = lagrangian_view_from(model, t, &state.q, v, &state.p)?;
    let (time, moving) = (Dual::new(t, 1.0), duals(&state.q, v));
    let (momentum, _) = explicit(model, time, &moving, v, &state.p)?;
    let mut along = DualRows::<N>::new(M::CONSTRAINTS.len());
    along.evaluate(model, time, &moving, v);
    reactions_along(model, (t, &state.q, v), (&view, &momentum), &along)
}

/// The reactions in a motion along which L_v and the constraints change so at a constant velocity.
fn reactions_along<const N: usize>(
    model: &dyn Constrains<N>,
    (t, q, v): (f64, &[f64; N], &[f64; N]),
    (view, momentum): (&LagrangianView<N>, &[f64; N]),
    along: &DualRows<N>,
) -> Result<Vec<f64>, StepError> {
    let gradients = gradients_with(view.second, model, (t, q, v));
    let mut force = [0.0; N];
    for a in 0..N {
        force[a] = view.first.q[a] + view.first.force[a] - momentum[a];
    }
    balance(&gradients, &force, along, v)
}

/// The reactions that balance a force except for the part that accelerates.
fn balance<const N: usize>(
    gradients: &Gradients<N>,
    force: &[f64; N],
    along: &DualRows<N>,
    v: &[f64; N],
) -> Result<Vec<f64>, StepError> {
    let Gradients {
        rows,
        independent,
        second,
        ..
    } = gradients;
    let chosen: Vec<usize> = (0..rows.len()).filter(|c| independent[*c]).collect();
    let size = N + chosen.len();
    let (mut matrix, mut vector) = (vec![0.0; size * size], vec![0.0; size]);
    for a in 0..N {
        matrix[a * size..a * size + N].copy_from_slice(&second.zz[a]);
        vector[a] = force[a];
    }
    for (k, c) in chosen.iter().enumerate() {
        for a in 0..N {
            matrix[(N + k) * size + a] = rows[*c][a];
            matrix[a * size + N + k] = -rows[*c][a];
        }
        vector[N + k] = -along.psi_slope(*c, v);
    }
    let mut pivots = vec![0; size];
    factor_bordered::<N>(size, &mut matrix, &mut pivots)?;
    lu::solve(size, &matrix, &pivots, &mut vector);
    if !vector.iter().all(|value| value.is_finite()) {
        return Err(StepError::NonFinite);
    }
    spread(rows, &chosen, &vector[N..])
}

/// The range of lengths whose squares, and products of these, neither overflow nor lose digits.
const ORDINARY: core::ops::Range<f64> = 1e-70..1e70;

/// Products of rows whose lengths differ by at most this factor lose no digits beside one another.
const ALIKE: f64 = 1e6;

/// The multipliers of all rows with the least Σ λ² that give the same Aᵀλ as those of the independent rows.
fn spread<const N: usize>(
    rows: &[[f64; N]],
    chosen: &[usize],
    multipliers: &[f64],
) -> Result<Vec<f64>, StepError> {
    let rank = chosen.len();
    if rank == rows.len() {
        return Ok(multipliers.to_vec());
    }
    // Rows are divided by their lengths if products of these would overflow, lose digits, or stand beside much larger
    // ones; else by one.
    let mut lengths: Vec<f64> = rows.iter().map(norm).collect();
    let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
    for length in lengths.iter().filter(|length| **length != 0.0) {
        (shortest, longest) = (shortest.min(*length), longest.max(*length));
    }
    let is_ordinary = longest <= ALIKE * shortest
        && (lengths.iter()).all(|length| *length == 0.0 || ORDINARY.contains(length));
    for length in &mut lengths {
        if is_ordinary || *length == 0.0 {
            *length = 1.0;
        }
    }
    let pairs = rows.iter().zip(&lengths);
    let units: Vec<[f64; N]> = pairs.map(|(row, length)| scaled(row, *length)).collect();
    let mut pivots = vec![0; rank];
    let mut gram: Vec<f64> = chosen
        .iter()
        .flat_map(|a| chosen.iter().map(|b| dot(&units[*a], &units[*b])))
        .collect();
    lu::factor(rank, &mut gram, &mut pivots).map_err(|_| StepError::NonFinite)?;
    // Every row is a combination of the independent ones, A = C A_i; then λ = C (CᵀC)⁻¹ λ_i.
    let combinations: Vec<Vec<f64>> = units
        .iter()
        .zip(&lengths)
        .map(|(unit, length)| {
            let mut side: Vec<f64> = chosen.iter().map(|c| dot(unit, &units[*c])).collect();
            lu::solve(rank, &gram, &pivots, &mut side);
            for (entry, c) in side.iter_mut().zip(chosen) {
                *entry *= length / lengths[*c];
            }
            side
        })
        .collect();
    let mut normal = vec![0.0; rank * rank];
    for combination in &combinations {
        for a in 0..rank {
            for b in 0..rank {
                normal[a * rank + b] += combination[a] * combination[b];
            }
        }
    }
    let is_lost = lu::factor(rank, &mut normal, &mut pivots).is_err()
        || (0..rank).any(|column| lu::is_lost(rank, &normal, column, LOST));
    let all = if is_lost {
        least(combinations, multipliers)
    } else {
        let mut weights = multipliers.to_vec();
        lu::solve(rank, &normal, &pivots, &mut weights);
        let all = combinations.iter().map(|combination| {
            let parts = combination.iter().zip(&weights);
            parts.map(|(c, w)| c * w).sum::<f64>()
        });
        all.collect()
    };
    if all.iter().all(|value| value.is_finite()) {
        Ok(all)
    } else {
        Err(StepError::NonFinite)
    }
}

/// Pivots of CᵀC below this part of what was subtracted on the way to them have lost digits: the squares of rows of
/// different scales stand beside one another there.
const LOST: f64 = 1e-4;

/// The least λ with Cᵀλ = μ by C = Q R, λ = Q R⁻ᵀ μ: no squares.
#[cold]
#[inline(never)]
fn least(mut combinations: Vec<Vec<f64>>, multipliers: &[f64]) -> Vec<f64> {
    // Twice is enough for orthogonality to rounding where lengths are alike; rows of different scales lose digits in
    // the first pass.
    const PASSES: usize = 3;
    let mut weights = multipliers.to_vec();
    for column in 0..weights.len() {
        for _ in 0..PASSES {
            for before in 0..column {
                let parts = combinations.iter().map(|row| row[before] * row[column]);
                let part: f64 = parts.sum();
                for row in &mut combinations {
                    row[column] -= part * row[before];
                }
                weights[column] -= part * weights[before];
            }
        }
        let length = scaled_norm(combinations.iter().map(|row| row[column]));
        for row in &mut combinations {
            row[column] /= length;
        }
        weights[column] /= length;
    }
    let sums = combinations.iter().map(|row| {
        let parts = row.iter().zip(&weights);
        parts.map(|(q, weight)| q * weight).sum::<f64>()
    });
    sums.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x = 0, y = 0 and s (x + y) = 0 under the forces 1 and 3: λ₃ = 4s/(1 + 2s²), λ₁ = 1 − s λ₃, λ₂ = 3 − s λ₃.
    #[test]
    fn rows_of_any_scale_share_a_load() {
        for s in [1e-12, 1e-3, 1.0, 30.0, 1e3, 1e6, 1e7, 1e8, 1e12] {
            let rows = [[1.0, 0.0], [0.0, 1.0], [s, s]];
            let found = spread(&rows, &[0, 1], &[1.0, 3.0]).expect("independent rows");
            // 4s²/(1 + 2s²)
            let third = 4.0 / (1.0 / (s * s) + 2.0);
            let off = [
                found[0] - (1.0 - third),
                found[1] - (3.0 - third),
                s * found[2] - third,
            ];
            for off in off {
                // Below the scale 30 squares lose three digits.
                assert!(off.abs() < 1e-12, "{s:e}: {off:e}");
            }
        }
    }
}
