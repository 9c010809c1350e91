//! The violation of constraints by a start, relative to the size of the terms of each constraint (T-165).

use super::at_rest::are_roundings;
use super::inertia::Legendre;
use super::model::{FamilyState, Model};
use super::node::Node;
use super::pattern::Pattern;
use super::rows::Rows;
use crate::constrained::residual::{REST, farthest, largest_gap};
use crate::control::{POSITION_ROUND_OFF, START_TOLERANCE};
use crate::enclosure::Enclosure;
use crate::error::{ConstraintError, StepError};
use crate::legendre::largest;
use alloc::vec;
use alloc::vec::Vec;

/// A start, with what is known of it.
pub(super) struct Start<'a> {
    pub(super) state: &'a FamilyState,
    /// The rows at its coordinates.
    pub(super) rows: &'a Rows,
    /// Where the velocity that the constraints admit was found.
    pub(super) node: &'a Node,
    /// That velocity.
    pub(super) admitted: &'a [f64],
    /// The error that iterations may leave, relative to all positions or velocities.
    pub(super) tolerance: f64,
}

impl Start<'_> {
    /// Refuses a start that violates the constraints by more than the rounding errors of a mechanism at rest.
    pub(super) fn check<M: Model>(&self, model: &M, times: (f64, f64)) -> Result<(), StepError> {
        let own = self.own_velocity(model, times.0);
        let Some((row, position, residual)) = self.violation(model, times, own.as_deref()) else {
            return Ok(());
        };
        let v = own.as_deref().unwrap_or(self.admitted);
        if are_roundings(model, times, (&self.state.q, v), self.rows, &self.off()) {
            return Ok(());
        }
        let constraint = model.constraint_name(row);
        Err(ConstraintError::Start {
            constraint,
            position,
            residual,
        }
        .into())
    }

    /// Refuses a start to which the motion has led, with velocity `v`, but whose positions constraints do not allow: their
    /// values jump there.
    pub(super) fn check_continuity<M: Model>(
        &self,
        model: &M,
        times: (f64, f64),
        v: &[f64],
    ) -> Result<(), StepError> {
        let q = &self.state.q;
        let gap = largest_gap(largest(q), largest(v), times);
        let distances = self.rows.distances();
        match distances.iter().position(|distance| *distance > gap) {
            Some(row) if !are_roundings(model, times, (q, v), self.rows, &[]) => {
                Err(ConstraintError::Discontinuous {
                    constraint: model.constraint_name(row),
                    distance: distances[row],
                }
                .into())
            }
            _ => Ok(()),
        }
    }

    /// The same behind a kink of constraints, where it may have a velocity that they only allowed before.
    pub(super) fn check_behind<M: Model>(
        &self,
        model: &M,
        times: (f64, f64),
    ) -> Result<(), StepError> {
        let before = self.own_velocity(model, times.0);
        let v = before.as_deref().unwrap_or(self.admitted);
        self.check_continuity(model, times, v)
    }

    /// The part of the momenta that the constraints do not allow.
    fn off(&self) -> Vec<f64> {
        let pairs = self.state.p.iter().zip(&self.node.slope);
        pairs.map(|(p, slope)| p - slope).collect()
    }

    /// The velocity that belongs to the momentum without regard to the constraints; `None` if that is the admissible
    /// one, or if there is none.
    fn own_velocity<M: Model>(&self, model: &M, t: f64) -> Option<Vec<f64>> {
        /// Momenta that differ by less have velocities that are the same, as far as starts are checked.
        const SAME: f64 = 1e-12;

        let mut pairs = self.state.p.iter().zip(&self.node.slope);
        let differ = |(p, slope): (&f64, &f64)| (p - slope).abs() > SAME * (p.abs() + slope.abs());
        let differ = pairs.any(differ);
        let velocity = || Legendre::default().velocity(model, t, self.state);
        differ.then(velocity)?.ok()
    }

    /// The first constraint that is violated: whether by positions, and the relative violation.
    fn violation<M: Model>(
        &self,
        model: &M,
        (t, h): (f64, f64),
        own: Option<&[f64]>,
    ) -> Option<(usize, bool, f64)> {
        let (FamilyState { q, p }, rows) = (self.state, self.rows);
        let extent = farthest(largest(q), largest(self.admitted), h);
        for (row, distance) in rows.distances().into_iter().enumerate() {
            if !(distance <= START_TOLERANCE * extent || distance == 0.0) {
                return Some((row, true, distance / extent));
            }
        }
        let found = violated(model, (t, h), (q, own), rows, self.tolerance);
        if found.is_some() {
            return found;
        }
        // If the start violates the constraints, the admissible velocity belongs to another momentum.
        let off = largest(&self.off());
        let impulse = largest(p).max(REST * extent / h.abs() * self.node.largest_mass());
        if off <= START_TOLERANCE * impulse || off == 0.0 {
            return None;
        }
        let shares = self.node.multipliers().iter().zip(rows.lengths());
        let shares = shares.map(|(eta, length)| (eta * length).abs()).enumerate();
        let (row, _) = shares.fold(
            (0, 0.0),
            |most, one| if one.1 > most.1 { one } else { most },
        );
        Some((row, false, off / impulse))
    }
}

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
fn violated<M: Model>(
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
