//! The order of several events in one element, simultaneous events, and the signs of the other functions after an event
//! has changed the state.
//!
//! Roots are found on the polynomial of the element. The nodes of elements that end at the events are more accurate and
//! may be in another order; the order of the nodes decides.

use super::act::After;
use super::locate::Met;
use super::remaining::{Crossed, Remaining};
use super::search::Root;
use super::searched::Searched;
use super::{Cut, Events, Passage};
use crate::error::RunErrorKind;
use crate::length::Length;
use crate::motion::LastCut;

/// What the node at an event says about another watched function.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Standing {
    /// It changes its sign at the same time, within the uncertainty of the time.
    Together,
    /// It has changed its sign already, although its root on the polynomial comes later.
    Passed,
    /// It has this sign.
    On(f64),
    /// It was zero at a time that rounding error does not separate from the event.
    Unknown,
}

/// Classifies a function that had the sign `side`, from its value and its derivative along the run.
///
/// `uncertainty` is that of the time; `is_beside` says that its root on the polynomial coincides with that of the
/// event.
fn standing(side: f64, (value, slope): (f64, f64), uncertainty: f64, is_beside: bool) -> Standing {
    if side == 0.0 || value.is_nan() {
        return Standing::Unknown;
    }
    let crosses = side * slope < 0.0;
    let is_near = value.abs() <= uncertainty * slope.abs();
    if (is_beside && side * value < 0.0) || (is_near && crosses) {
        Standing::Together
    } else if is_near && slope != 0.0 {
        Standing::Unknown
    } else if crosses && side * value < 0.0 {
        Standing::Passed
    } else if value == 0.0 {
        // No change of sign was seen.
        Standing::On(side)
    } else {
        Standing::On(value.signum())
    }
}

/// The functions at the time of an event.
pub(super) struct Meeting {
    /// All events at this time, in the order of declaration.
    pub(super) together: Vec<Crossed>,
    /// Events that should have been met earlier.
    pub(super) passed: Vec<Crossed>,
    /// The signs of all other functions; 0 if unknown.
    pub(super) sides: Vec<f64>,
}

/// The distance within which events are simultaneous, in units of the resolution of time.
const TOGETHER: f64 = 8.0;

/// The same for two roots of one polynomial.
const BESIDE: f64 = 16.0;

impl<const N: usize, L: Length<N>> Events<'_, N, L> {
    /// Whether the direction of a zero crossing is one that its event watches.
    pub(super) fn counts(&self, Crossed { function, rises }: Crossed) -> bool {
        self.watched[function].on.crossing.counts(rises)
    }

    /// The next of the remaining roots that is an event, with the end of the element that meets it. Roots before it are
    /// taken out. `is_begun` tells for each function whether its sign is known or a root was seen.
    pub(super) fn next_event(
        &self,
        run: &mut dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
        (remaining, is_begun): (&mut Remaining, &mut [bool]),
        resolution: f64,
    ) -> Option<(Root, Met<N, L>)> {
        loop {
            let root = remaining.first()?;
            if !self.counts(Crossed::from(&root)) {
                remaining.take(root.function);
                continue;
            }
            let met = self.located(run, arc, &root, resolution);
            // If the run begins on a zero, the polynomial may first move to the wrong side, by less than its error.
            let begins = !std::mem::replace(&mut is_begun[root.function], true);
            if begins && (met.time == arc.t || self.begins_wrongly(run, arc, &root, resolution)) {
                remaining.take(root.function);
                continue;
            }
            let (root, met) = self.earliest(run, arc, remaining, (root, met), resolution);
            if self.is_seen_again(run.model(), arc, &root, met.time) {
                remaining.take(root.function);
                continue;
            }
            return Some((root, met));
        }
    }

    /// The first event by nodes: the given one, or one whose function has already changed its sign at that node
    /// although its root on the polynomial comes later.
    pub(super) fn earliest(
        &self,
        run: &mut dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
        remaining: &Remaining,
        (mut root, mut met): (Root, Met<N, L>),
        resolution: f64,
    ) -> (Root, Met<N, L>) {
        let count = self.watched.len();
        if count == 1 {
            return (root, met);
        }
        let mut is_tried = vec![false; count];
        is_tried[root.function] = true;
        loop {
            let has_passed = |function: usize| {
                let along = arc.h.signum() * met.slopes[function];
                let here = (met.values[function], along);
                let side = remaining.side(function);
                standing(side, here, TOGETHER * resolution, false) == Standing::Passed
            };
            let untried = (0..count).filter(|function| !is_tried[*function]);
            let mut roots = untried.filter_map(|function| remaining.next(function));
            let other =
                roots.find(|other| self.counts(Crossed::from(other)) && has_passed(other.function));
            let Some(other) = other else {
                return (root, met);
            };
            is_tried[other.function] = true;
            let found = self.locate(run, arc, &other, resolution);
            if let Some(found) = found.filter(|found| found.length.abs() < met.length.abs()) {
                (root, met) = (other, found);
            }
        }
    }

    /// Classifies all watched functions at the time of an event.
    pub(super) fn meeting(
        &self,
        arc: &Passage<'_, N, L>,
        remaining: &Remaining,
        (root, met): (&Root, &Met<N, L>),
        resolution: f64,
    ) -> Meeting {
        let own = Crossed::from(root);
        let count = self.watched.len();
        let mut meeting = Meeting {
            together: Vec::with_capacity(1),
            passed: Vec::new(),
            sides: vec![0.0; count],
        };
        if count == 1 {
            meeting.together.push(own);
            return meeting;
        }
        // The uncertainty that the search for the time has left.
        let left = (met.values[root.function] / met.slopes[root.function]).abs();
        let left = if left.is_finite() { 2.0 * left } else { 0.0 };
        let usual = TOGETHER * resolution;
        for function in 0..count {
            if function == root.function {
                meeting.together.push(own);
                continue;
            }
            let side = remaining.side(function);
            let crossed = Crossed {
                function,
                rises: side < 0.0,
            };
            let is_beside = remaining.next(function).is_some_and(|other| {
                (other.tau - root.tau).abs() * arc.h.abs() <= BESIDE * resolution
            });
            let uncertainty = match is_beside {
                true => usual.max(left),
                false => usual,
            };
            let along = arc.h.signum() * met.slopes[function];
            let here = (met.values[function], along);
            let last = self.last_of(crossed, met.time);
            let counts = self.counts(crossed) && last.is_none_or(|last| !last.is_idle);
            match standing(side, here, uncertainty, is_beside) {
                Standing::Together if counts => meeting.together.push(crossed),
                Standing::Passed if counts => meeting.passed.push(crossed),
                Standing::Passed => meeting.sides[function] = -side,
                Standing::On(side) => meeting.sides[function] = side,
                Standing::Together | Standing::Unknown => {}
            }
        }
        meeting
    }

    /// The last cut by this event, if it was so recent that the function may not have moved since.
    pub(super) fn last_of(&self, crossed: Crossed, time: f64) -> Option<LastCut> {
        let Crossed { function, rises } = crossed;
        let last = self.seen.lasts[function]?;
        (last.rises == rises && self.is_soon(last.time, time)).then_some(last)
    }

    /// Sets the events that are due at once after an element was cut, and the signs of the other functions.
    pub(super) fn leave(
        &mut self,
        run: &dyn Searched<N, L>,
        (meeting, number): (Meeting, usize),
        met: &Met<N, L>,
        after: Option<&After<N, L>>,
    ) {
        let Meeting {
            together,
            passed,
            sides,
        } = meeting;
        for recorded in &together[..number] {
            self.note_recorded(*recorded, met.time);
        }
        self.due.clear();
        if after.is_some() {
            self.due.extend(passed);
            self.due.extend(&together[number + 1..]);
            let due = self.due.make_contiguous();
            due.sort_by_key(|crossed| crossed.function);
        }
        self.seen.sides = sides;
        self.carry_sides(run, &met.values, after, (met.time, &met.velocity));
    }

    /// Marks an event as recorded at the node from which the run continues, so that it is not met again if the next
    /// polynomial starts with another velocity.
    fn note_recorded(&mut self, Crossed { function, rises }: Crossed, time: f64) {
        self.seen.lasts[function] = Some(LastCut {
            time,
            function,
            rises,
            is_idle: true,
            impact: 0.0,
        });
    }

    /// Whether there are impacts after which the motion has not yet been seen to rebound.
    pub(super) fn has_impacts(&self) -> bool {
        let is_impact = |last: &LastCut| last.impact > 0.0;
        self.seen.lasts.iter().flatten().any(is_impact)
    }

    /// Checks the outcome of impacts, in an element that ends at `time`, with the values at its start and its end. A
    /// motion that passes the surface instead of rebounding has come to rest on it: the rebound was too short to be
    /// seen, and the forces press the motion through the surface.
    pub(super) fn check_impacts(
        &mut self,
        remaining: &Remaining,
        [begin, end]: &[Vec<f64>; 2],
        time: f64,
    ) -> Result<(), RunErrorKind> {
        /// A depth below this part of the impact speed times the time since the impact is rounding error: a motion
        /// without forces stays at the surface.
        const ROUNDING: f64 = 1e-9;
        /// The largest value at the start of the element, relative to that at its end, of a motion that starts on the
        /// surface.
        const ON_SURFACE: f64 = 1e-3;
        for (function, last) in self.seen.lasts.iter_mut().enumerate() {
            let Some(last) = last.as_mut().filter(|last| last.impact > 0.0) else {
                continue;
            };
            let beyond = if last.rises { 1.0 } else { -1.0 };
            let side = remaining.side(function);
            if side == -beyond {
                last.impact = 0.0;
                continue;
            }
            let depth = beyond * end[function];
            let least = ROUNDING * last.impact * (time - last.time).abs();
            if side == beyond && depth > least && begin[function].abs() < ON_SURFACE * depth {
                return Err(RunErrorKind::EventsWithoutEnd {
                    name: self.watched[function].on.name.clone(),
                    time: last.time,
                });
            }
        }
        Ok(())
    }

    /// Takes over the signs before an action for functions whose values it has not changed, except for rounding. The
    /// signs of the others are unknown until the next element; a change of sign by an action is no event.
    fn carry_sides(
        &mut self,
        run: &dyn Searched<N, L>,
        values: &[f64],
        after: Option<&After<N, L>>,
        (time, guess): (f64, &L::Vector),
    ) {
        let now = after.and_then(|after| self.values_after(run, after, time, guess));
        let Some(now) = now else {
            self.seen.sides.fill(0.0);
            return;
        };
        for ((side, before), now) in self.seen.sides.iter_mut().zip(values).zip(&now) {
            let is_near = (now - before).abs() <= 0.5 * before.abs();
            let has_stayed = now == before || (*side * now > 0.0 && is_near);
            if !has_stayed {
                *side = 0.0;
            }
        }
    }

    /// The values of all watched functions after an action, if the run can continue from there.
    fn values_after(
        &self,
        run: &dyn Searched<N, L>,
        after: &After<N, L>,
        time: f64,
        guess: &L::Vector,
    ) -> Option<Vec<f64>> {
        let After { state, set } = after;
        let model = match set {
            Some(_) => run.next_model(),
            None => run.model(),
        };
        model.check_restart(time, self.step, state).ok()?;
        let velocity = if self.needs_velocity {
            model.velocity(time, state, guess)?
        } else {
            L::zero(guess)
        };
        Some(self.row(model, (time, state, &velocity)))
    }

    /// Meets the events that are due at the time of the last cut, in the state that it has left, up to the first that
    /// ends an element.
    pub(in crate::simulation) fn meet_due(
        &mut self,
        run: &mut dyn Searched<N, L>,
        time: f64,
        state: &L::State,
    ) -> Result<Option<Cut<N, L>>, RunErrorKind> {
        self.recorded.clear();
        while let Some(crossed) = self.due.pop_front() {
            let (q, _) = L::parts(state);
            let velocity = run.model().velocity(time, state, &L::zero(q));
            let velocity = velocity.unwrap_or_else(|| L::unknown(q));
            let Some(done) = self.meet(run, crossed, (time, state, &velocity), (0.0, false))?
            else {
                self.note_recorded(crossed, time);
                continue;
            };
            if done.after.is_none() {
                self.due.clear();
            }
            let values = self.row(run.model(), (time, state, &velocity));
            self.carry_sides(run, &values, done.after.as_ref(), (time, &velocity));
            return Ok(Some(Cut {
                t: time,
                at: state.clone(),
                inside: None,
                after: done.after,
                place: done.place,
            }));
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RESOLUTION: f64 = 1e-15;

    fn of(side: f64, value: f64, slope: f64) -> Standing {
        standing(side, (value, slope), TOGETHER * RESOLUTION, false)
    }

    /// The example is a function that rises from below zero.
    #[test]
    fn a_node_tells_where_a_function_is() {
        assert_eq!(of(-1.0, -1e-9, 2.0), Standing::On(-1.0));
        assert_eq!(of(-1.0, 1e-9, 2.0), Standing::Passed);
        for value in [-1e-15, 0.0, 1e-15] {
            assert_eq!(of(-1.0, value, 2.0), Standing::Together);
            // It has crossed zero at an earlier event.
            assert_eq!(of(1.0, value, 2.0), Standing::Unknown);
        }
        // Its root, which was skipped, lies behind this node after all.
        assert_eq!(of(1.0, -1e-9, 2.0), Standing::On(-1.0));
        // The function is zero over an interval.
        assert_eq!(of(1.0, 0.0, 0.0), Standing::On(1.0));
        assert_eq!(of(0.0, 1.0, 1.0), Standing::Unknown);
        assert_eq!(of(1.0, f64::NAN, 1.0), Standing::Unknown);
        // It jumps at the event.
        let beside = standing(1.0, (-1.0, 3.0), TOGETHER * RESOLUTION, true);
        assert_eq!(beside, Standing::Together);
    }
}
