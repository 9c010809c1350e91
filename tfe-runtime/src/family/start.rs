//! The violation of constraints by a start, relative to the size of the terms of each constraint (T-165).

use super::model::Model;
use super::pattern::Pattern;
use super::rows::Rows;
use crate::control::{POSITION_ROUND_OFF, START_TOLERANCE};
use crate::enclosure::Enclosure;
use crate::legendre::largest;
use alloc::vec;
use alloc::vec::Vec;

/// The first constraint that a position violates by more than a start may, relative to the size of its terms, with this
/// relative violation; `None` if all hold. The rows have been evaluated at that position.
///
/// ```text
/// S = Σ_j |A_j| min(max |q|, |A| / |φ_qq,j|) + terms   is the scale for |φ|
/// ```
///
/// Distances below `least` are accepted: the tolerance of the iterations of the run allows them.
pub(super) fn violated<M: Model>(
    model: &M,
    (t, q): (f64, &[f64]),
    rows: &Rows,
    least: f64,
) -> Option<(usize, f64)> {
    let exactly = |x: f64| Enclosure::between(x, x);
    let places: Vec<Enclosure> = q.iter().map(|q| exactly(*q)).collect();
    let mut bounds = vec![Enclosure::ZERO; rows.phi.len()];
    model.constraint_values(exactly(t), &places, &mut bounds);
    let mut sums = vec![0.0_f64; rows.phi.len()];
    for ((row, coordinate), value) in rows.places().zip(&rows.values) {
        sums[row] += (value * q[coordinate]).abs();
    }
    let (lengths, extent) = (rows.lengths(), largest(q));
    let mut curvature: Option<Curvature> = None;
    for (row, bounds) in bounds.iter().enumerate() {
        let length = lengths[row];
        // An infinite enclosure says nothing of the terms.
        let terms = (bounds.high() - bounds.low()) / f64::EPSILON;
        let rounded = POSITION_ROUND_OFF * (sums[row] + (rows.drift[row] * t).abs());
        let phi = rows.phi[row].abs() - rounded;
        let is_suspect = phi > START_TOLERANCE * terms && phi > least * length;
        if !(is_suspect && length > 0.0 && (terms + length + extent).is_finite()) {
            continue;
        }
        let curvature = curvature.get_or_insert_with(|| Curvature::of(model));
        curvature.evaluate(model, (t, q), row);
        let own = rows.places().zip(&rows.values);
        let own = own.filter(|((constraint, _), _)| *constraint == row);
        // A coordinate that appears only linearly counts as far as all positions reach.
        let reaches =
            own.map(|((_, a), value)| value.abs() * (length / curvature.sizes[a]).min(extent));
        let part = phi / (terms + reaches.sum::<f64>());
        if part > START_TOLERANCE {
            return Some((row, part));
        }
    }
    None
}

/// The second derivatives of one constraint.
struct Curvature {
    pattern: Pattern,
    values: Vec<f64>,
    mu: Vec<f64>,
    /// |φ_qq,j| for each coordinate j.
    sizes: Vec<f64>,
}

impl Curvature {
    fn of<M: Model>(model: &M) -> Self {
        let pattern = Pattern::of_bends(model);
        Self {
            values: vec![0.0; pattern.places().len()],
            pattern,
            mu: vec![0.0; model.constraints()],
            sizes: vec![0.0; model.len()],
        }
    }

    fn evaluate<M: Model>(&mut self, model: &M, (t, q): (f64, &[f64]), row: usize) {
        self.mu.fill(0.0);
        self.mu[row] = 1.0;
        let mut entries = self.pattern.scatter(&mut self.values);
        model.constraint_second(t, q, &self.mu, &mut entries);
        self.sizes.fill(0.0);
        for ((_, a, _), value) in self.pattern.places().iter().zip(&self.values) {
            self.sizes[*a] = self.sizes[*a].hypot(*value);
        }
    }
}
