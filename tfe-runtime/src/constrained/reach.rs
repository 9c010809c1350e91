//! How fast reactions alone would move coordinates (T-168).

use crate::control::ROUGH_ROUND_OFF;
use crate::legendre::largest;
use alloc::vec;
use alloc::vec::Vec;

/// The entries of the rows of constraints that are not zero, with their coordinates.
pub(crate) type SparseRows = Vec<Vec<(usize, f64)>>;

/// Σ_c |A_ca λ_c|: the forces that constraints exert on each of n coordinates, were none of them to cancel another.
pub(crate) fn forces(rows: &SparseRows, reactions: &[f64], n: usize) -> Vec<f64> {
    let mut forces = vec![0.0; n];
    for (row, reaction) in rows.iter().zip(reactions) {
        for (a, entry) in row {
            forces[*a] += (entry * reaction).abs();
        }
    }
    forces
}

/// The velocities h Σ_c |A_ca λ_c| / M_aa that reactions λ would give to each coordinate alone in a time h.
/// Coordinates without loads, or without inertia of their own, move as the constraints make them follow others.
pub(crate) fn speeds(h: f64, masses: &[f64], rows: &SparseRows, reactions: &[f64]) -> Vec<f64> {
    /// Rows are passed forwards and backwards, so that chains of any length are followed in few passes.
    const PASSES: usize = 8;
    /// Entries below this part of the largest one of their row may be rounding errors: nothing follows by them.
    const SMALL: f64 = 1e-6;

    let forces = forces(rows, reactions, masses.len());
    let own = forces
        .iter()
        .zip(masses)
        .map(|(force, mass)| (h * force / mass).abs());
    let mut speeds: Vec<f64> = own
        .map(|own| if own.is_finite() { own } else { 0.0 })
        .collect();
    let mut follows = vec![false; speeds.len()];
    for pass in 0..PASSES {
        let mut is_changed = false;
        for k in 0..rows.len() {
            let row = &rows[if pass % 2 == 0 { k } else { rows.len() - 1 - k }];
            let rates: Vec<f64> = row
                .iter()
                .map(|(a, entry)| (entry * speeds[*a]).abs())
                .collect();
            let most = largest(&rates);
            let longest = row
                .iter()
                .fold(0.0_f64, |most, (_, entry)| most.max(entry.abs()));
            for ((a, entry), rate) in row.iter().zip(rates) {
                let is_slow = rate < ROUGH_ROUND_OFF * most;
                if is_slow && !follows[*a] && entry.abs() > SMALL * longest {
                    speeds[*a] = most / entry.abs();
                    (follows[*a], is_changed) = (true, true);
                }
            }
        }
        if !is_changed {
            break;
        }
    }
    speeds
}

/// The entries of these rows.
pub(super) fn sparse<const N: usize>(rows: &[[f64; N]]) -> SparseRows {
    let entries = |row: &[f64; N]| {
        let entries = row.iter().copied().enumerate();
        entries.filter(|(_, entry)| *entry != 0.0).collect()
    };
    rows.iter().map(entries).collect()
}

/// The diagonal of a mass matrix.
pub(super) fn diagonal<const N: usize>(mass: &[[f64; N]; N]) -> [f64; N] {
    core::array::from_fn(|a| mass[a][a])
}
