//! The violation of constraints by a start, relative to the size of the terms of each constraint (T-165).

use super::model::Model;
use super::pattern::Pattern;
use super::rows::Rows;
use crate::control::{POSITION_ROUND_OFF, START_TOLERANCE};
use crate::enclosure::Enclosure;
use crate::legendre::largest;
use alloc::vec;
use alloc::vec::Vec;

/// The first constraint that a start violates by more than it may, relative to the size of its terms: whether by
/// positions, and the relative violation; `None` if all hold. The rows have been evaluated at these coordinates, and
/// without velocities only positions are compared.
///
/// ```text
/// S = Σ_j |A_j| min(max |q|, |A| / |φ_qq,j|) + terms   for |φ| ,     max(|A| |v| + |a|, S/h)   for |A v + a| ,
/// ```
///
/// where v has only the coordinates of the constraint. Errors of a relative size `tolerance` of all positions or
/// velocities are accepted: the tolerance of the iterations of the run allows them.
pub(super) fn violated<M: Model>(
    model: &M,
    (t, h): (f64, f64),
    (q, v): (&[f64], Option<&[f64]>),
    rows: &Rows,
    tolerance: f64,
) -> Option<(usize, bool, f64)> {
    let exactly = |x: f64| Enclosure::between(x, x);
    let places: Vec<Enclosure> = q.iter().map(|q| exactly(*q)).collect();
    let mut bounds = vec![Enclosure::ZERO; rows.phi.len()];
    model.constraint_values(exactly(t), &places, &mut bounds);
    let mut rates = vec![0.0; rows.phi.len()];
    let still = vec![0.0; q.len()];
    if let Some(v) = v {
        rows.rate(v, &mut rates);
    }
    let v = v.unwrap_or(&still);
    let (mut sums, mut speeds) = (vec![0.0_f64; rows.phi.len()], vec![0.0_f64; rows.phi.len()]);
    for ((row, coordinate), value) in rows.places().zip(&rows.values) {
        sums[row] += (value * q[coordinate]).abs();
        speeds[row] += (value * v[coordinate]).abs();
    }
    let (lengths, extent, speed) = (rows.lengths(), largest(q), largest(v));
    let mut curvature: Option<Curvature> = None;
    for (row, bounds) in bounds.iter().enumerate() {
        let (length, drift) = (lengths[row], rows.drift[row].abs());
        // An infinite enclosure says nothing of the terms.
        let terms = (bounds.high() - bounds.low()) / f64::EPSILON;
        let rounded = POSITION_ROUND_OFF * (sums[row] + drift * t.abs());
        let phi = rows.phi[row].abs() - rounded;
        let psi = rates[row].abs() - (POSITION_ROUND_OFF + tolerance) * length * speed;
        let is_off = phi > START_TOLERANCE * terms && phi > tolerance * extent * length;
        let turns = psi > START_TOLERANCE * (speeds[row] + drift).max(terms / h.abs());
        let is_known = length > 0.0 && (terms + length + extent).is_finite();
        if !(is_known && (is_off || turns)) {
            continue;
        }
        let curvature = curvature.get_or_insert_with(|| Curvature::of(model));
        curvature.evaluate(model, (t, q), row);
        let own = || {
            let all = rows.places().zip(&rows.values);
            all.filter(|((constraint, _), _)| *constraint == row)
        };
        // A coordinate that appears only linearly counts as far as all positions reach.
        let reaches =
            own().map(|((_, a), value)| value.abs() * (length / curvature.sizes[a]).min(extent));
        let size = terms + reaches.sum::<f64>();
        if is_off && phi / size > START_TOLERANCE {
            return Some((row, true, phi / size));
        }
        let mut own_speed = curvature.speed(v);
        for ((_, a), value) in own() {
            if *value != 0.0 && curvature.sizes[a] == 0.0 {
                own_speed = own_speed.hypot(v[a]);
            }
        }
        let psi = psi - POSITION_ROUND_OFF * curvature.turned(q, v);
        let part = psi / (length * own_speed + drift).max(size / h.abs());
        if turns && part > START_TOLERANCE {
            return Some((row, false, part));
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

    /// |v| of the coordinates on which the gradient depends.
    fn speed(&self, v: &[f64]) -> f64 {
        let bent = self.sizes.iter().zip(v).filter(|(size, _)| **size != 0.0);
        bent.fold(0.0, |sum: f64, (_, v)| sum.hypot(*v))
    }

    /// A bound of Σ_j |(φ_qq v)_j q_j|, of which rounding errors of the coordinates change a part.
    fn turned(&self, q: &[f64], v: &[f64]) -> f64 {
        let places = self.pattern.places().iter().zip(&self.values);
        places
            .map(|((_, a, b), value)| (value * v[*b] * q[*a]).abs())
            .sum()
    }
}
