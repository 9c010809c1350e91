//! Locates an event: finds the length of the element that ends on it (T-122).

use super::model::EventModel;
use super::search::Root;
use super::searched::Searched;
use super::{Cut, Events, Passage};
use crate::length::{Length, Polynomial};
use crate::simulation::acting;

/// A located event.
pub(super) struct Met<const N: usize, L: Length<N>> {
    pub(super) length: f64,
    /// The time; that of a node if they differ by rounding only.
    pub(super) time: f64,
    pub(super) state: L::State,
    pub(super) velocity: L::Vector,
    /// The values of all watched functions.
    pub(super) values: Vec<f64>,
    /// Their time derivatives on the polynomial.
    pub(super) slopes: Vec<f64>,
    pub(super) inside: Option<L::Polynomial>,
}

/// The relative difference from which on lengths are trusted more than differences of times, which lose digits at large
/// t.
const DIGITS: f64 = 1e-12;

impl<const N: usize, L: Length<N>> Cut<N, L> {
    /// The distance from the start of the element that was cut: the difference of times, or the length where times have
    /// fewer digits than the step `h`.
    pub(in crate::simulation) fn length_from(&self, from: f64, h: f64) -> f64 {
        let (between, length) = (self.t - from, self.place.length);
        if self.place.inside && (length - between).abs() > DIGITS * h.abs() {
            length
        } else {
            between
        }
    }
}

impl<const N: usize, L: Length<N>> Events<'_, N, L> {
    /// The event at a root of the polynomial: the end of an element that ends there, or, if no such element can be
    /// solved, the point of the polynomial.
    pub(super) fn located(
        &self,
        run: &mut dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
        root: &Root,
        resolution: f64,
    ) -> Met<N, L> {
        if let Some(met) = self.locate(run, arc, root, resolution) {
            return met;
        }
        let Passage { t, h, dense, .. } = *arc;
        let length = root.tau * h;
        let state = dense.at_time(t + length);
        let velocity = dense.velocity_at_time(t + length);
        Met {
            length,
            time: arc.time(length, resolution),
            values: self.row(run.model(), (t + length, &state, &velocity)),
            slopes: self.slopes(run.model(), arc, length),
            state,
            velocity,
            inside: None,
        }
    }

    /// Finds the length of the element whose end lies on the event, starting from the root of the polynomial; nodes are
    /// more accurate than the polynomial between them. `None` if such an element cannot be solved.
    pub(super) fn locate(
        &self,
        run: &mut dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
        root: &Root,
        resolution: f64,
    ) -> Option<Met<N, L>> {
        /// The largest number of corrections of the length; they converge quadratically.
        const MAX_TRIALS: u32 = 8;
        /// How far a correction may lead beyond the element, relative to its length; it is then limited to the end.
        const OVERSHOOT: f64 = 0.5;

        let Passage {
            t, begin, h, dense, ..
        } = *arc;
        let enough = (0.25 * resolution).min(DIGITS * self.step.abs());
        let mut length = root.tau * h;
        let mut last = f64::INFINITY;
        let mut passed = None;
        let mut met = None;
        for _ in 0..MAX_TRIALS {
            let time = arc.time(length, resolution);
            let (state, inside) = if length.abs() > resolution {
                let impulses = &arc.impulses[..acting::behind(arc.impulses, time, h)];
                let solved = run.solved((begin, length), arc.before, impulses, (t, time))?;
                (solved.0, Some(solved.1))
            } else {
                (arc.before.clone(), None)
            };
            let guess = dense.velocity_at_time(t + length);
            let model = run.model();
            let velocity = model.velocity(t + length, &state, &guess)?;
            let values = self.row(model, (t + length, &state, &velocity));
            let slopes = self.slopes(model, arc, length);
            let (value, along) = (values[root.function], slopes[root.function]);
            met = Some(Met {
                length,
                time,
                state,
                velocity,
                values,
                slopes,
                inside,
            });
            let slope = self.slope(model, (arc, root), along, (length, value), passed);
            let change = -value / slope;
            let next = (length + change) * h.signum();
            let beyond = (-next).max(next - h.abs());
            let most = (OVERSHOOT * change.abs()).max(resolution);
            if root.is_left_at_once(along * h.signum())
                || !(change.abs() < last && beyond <= most)
                || change.abs() <= enough
            {
                break;
            }
            last = change.abs();
            passed = Some((length, value));
            length = next.clamp(0.0, h.abs()) * h.signum();
        }
        met
    }

    /// dg/dt for a correction of the length: the secant through the last two nodes if it is close to the slope on the
    /// polynomial. The secant is also used if g crosses zero between nodes but not along the polynomial, as velocities
    /// of elements of low order can.
    fn slope(
        &self,
        model: &dyn EventModel<N, L>,
        (arc, root): (&Passage<'_, N, L>, &Root),
        along: f64,
        (length, value): (f64, f64),
        passed: Option<(f64, f64)>,
    ) -> f64 {
        let crosses = |slope: &f64| root.is_crossed_with(slope * arc.h.signum());
        let secant = passed.map(|(from, before)| (value - before) / (length - from));
        let secant = secant.filter(crosses);
        if crosses(&along) {
            let is_near = |slope: &f64| (0.25..4.0).contains(&(slope / along));
            return secant.filter(is_near).unwrap_or(along);
        }
        let chord = || {
            let at = |time: f64, state: &L::State| {
                let guess = arc.dense.velocity_at_time(time);
                let velocity = model.velocity(time, state, &guess)?;
                Some(self.row(model, (time, state, &velocity))[root.function])
            };
            let ends = (at(arc.t, arc.before)?, at(arc.dense.end(), arc.after)?);
            Some((ends.1 - ends.0) / arc.h).filter(crosses)
        };
        secant.or_else(chord).unwrap_or(along)
    }

    /// The time derivatives of all watched functions on the polynomial.
    fn slopes(
        &self,
        model: &dyn EventModel<N, L>,
        arc: &Passage<'_, N, L>,
        length: f64,
    ) -> Vec<f64> {
        const NEAR: f64 = 1e-4;
        let Passage { t, h, dense, .. } = *arc;
        let values = |length: f64| {
            let (state, v) = (
                dense.at_time(t + length),
                dense.velocity_at_time(t + length),
            );
            self.row(model, (t + length, &state, &v))
        };
        let (from, to) = (
            (length / h - NEAR).max(0.0) * h,
            (length / h + NEAR).min(1.0) * h,
        );
        let slope = |(low, high): (f64, f64)| (high - low) / (to - from);
        values(from)
            .into_iter()
            .zip(values(to))
            .map(slope)
            .collect()
    }
}
