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
        let place = (length, arc.time(length, resolution));
        self.met(run.model(), arc, place, (state, velocity, None))
    }

    /// The functions at a place of an element, given by its length and its time, where the motion has this state and this
    /// velocity.
    fn met(
        &self,
        model: &dyn EventModel<N, L>,
        arc: &Passage<'_, N, L>,
        (length, time): (f64, f64),
        (state, velocity, inside): (L::State, L::Vector, Option<L::Polynomial>),
    ) -> Met<N, L> {
        Met {
            length,
            time,
            values: self.row(model, (arc.t + length, &state, &velocity)),
            slopes: self.slopes(model, arc, length),
            state,
            velocity,
            inside,
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

        if self.jumps(run.model(), arc, root, resolution) {
            return self.behind_jump(run, arc, root, resolution);
        }
        let h = arc.h;
        let enough = (0.25 * resolution).min(DIGITS * self.step.abs());
        let mut length = root.tau * h;
        let mut last = f64::INFINITY;
        let mut passed = None;
        let mut met = None;
        for _ in 0..MAX_TRIALS {
            let end = self.end_at(run, arc, length, resolution)?;
            let (value, along) = (end.values[root.function], end.slopes[root.function]);
            met = Some(end);
            let slope = self.slope(run.model(), (arc, root), along, (length, value), passed);
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

    /// Whether the function has the sign that it has before its first root on the polynomial alone, and not at the end of an
    /// element that ends halfway to this root.
    pub(super) fn begins_wrongly(
        &self,
        run: &mut dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
        root: &Root,
        resolution: f64,
    ) -> bool {
        let halfway = self.end_at(run, arc, 0.5 * root.tau * arc.h, resolution);
        halfway.is_some_and(|met| root.is_crossed_with(met.values[root.function]))
    }

    /// The end of an element of this length.
    fn end_at(
        &self,
        run: &mut dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
        length: f64,
        resolution: f64,
    ) -> Option<Met<N, L>> {
        let Passage {
            t, begin, h, dense, ..
        } = *arc;
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
        Some(self.met(model, arc, (length, time), (state, velocity, inside)))
    }

    /// Whether the function jumps over zero, as a `select` or an input that is a step: it changes beside the root nearly as
    /// much as in a wide part of the element, so that its slope tells nothing.
    fn jumps(
        &self,
        model: &dyn EventModel<N, L>,
        arc: &Passage<'_, N, L>,
        root: &Root,
        resolution: f64,
    ) -> bool {
        const WIDE: f64 = 1e-4;
        const NARROW: f64 = 1e-8;
        let Passage { t, h, dense, .. } = *arc;
        let narrow = (4.0 * resolution / h.abs()).max(NARROW);
        let at = |tau: f64| {
            let time = t + tau.clamp(0.0, 1.0) * h;
            let (state, v) = (dense.at_time(time), dense.velocity_at_time(time));
            self.row(model, (time, &state, &v))[root.function]
        };
        let around = |part: f64| (at(root.tau - part), at(root.tau + part));
        let ((before, behind), wide) = (around(narrow), around(WIDE));
        narrow < 0.1 * WIDE
            && root.is_crossed_with(behind - before)
            && before * behind < 0.0
            && (behind - before).abs() > 0.5 * (wide.1 - wide.0).abs()
    }

    /// The end of the shortest element, up to the resolution of the time, that ends behind a jump: of elements that end on
    /// either side of it, beginning beside the root on the polynomial.
    fn behind_jump(
        &self,
        run: &mut dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
        root: &Root,
        resolution: f64,
    ) -> Option<Met<N, L>> {
        let (whole, direction) = (arc.h.abs(), arc.h.signum());
        let mut end = |length: f64| self.end_at(run, arc, direction * length, resolution);
        let is_behind = |met: &Met<N, L>| root.is_crossed_with(met.values[root.function]);
        let (mut low, mut high) = (root.tau * whole, root.tau * whole);
        let mut met = end(high)?;
        let mut width = resolution;
        if is_behind(&met) {
            while low > 0.0 {
                low = (low - width).max(0.0);
                width *= 4.0;
                let other = end(low)?;
                if !is_behind(&other) {
                    break;
                }
                (met, high) = (other, low);
            }
        } else {
            while !is_behind(&met) {
                if high >= whole {
                    return None;
                }
                low = high;
                high = (high + width).min(whole);
                width *= 4.0;
                met = end(high)?;
            }
        }
        while high - low > resolution {
            let middle = 0.5 * (low + high);
            let other = end(middle)?;
            if is_behind(&other) {
                (met, high) = (other, middle);
            } else {
                low = middle;
            }
        }
        Some(met)
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
