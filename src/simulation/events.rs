//! Events of runs: finds the zero crossings of outputs and functions, and applies the actions there (T-122).

pub(super) mod act;
mod clear;
mod evaluate;
mod locate;
pub(super) mod model;
pub(super) mod on;
mod order;
mod remaining;
pub(super) mod remodel;
mod roundings;
mod search;
pub(super) mod searched;
pub(super) mod settings;
pub(super) mod value;
pub(super) mod watching;

use super::acting;
use crate::error::RunErrorKind;
use crate::length::{FixedLength, Length, Polynomial};
use crate::motion::{LastCut, Seen};
use act::{Act, After, Event, On};
use clear::Clear;
use model::EventModel;
use remaining::{Crossed, Remaining};
use searched::Searched;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::fmt;
use tfe_runtime::dual::Dual;
use tfe_runtime::enclosure::Enclosure;
use tfe_runtime::step::Impulse;
use value::Value;

/// An event that a run watches.
#[derive(Clone)]
pub struct Watched<'m, const N: usize, L: Length<N> = FixedLength> {
    pub(super) on: On<'m, N, L>,
    pub(super) value: Value<'m, L::Vector>,
}

impl<const N: usize, L: Length<N>> Watched<'_, N, L> {
    /// Whether it is a function given by the user.
    fn is_function(&self) -> bool {
        matches!(self.value, Value::Function(_))
    }
}

/// The search for the events of a run.
pub(super) struct Events<'m, const N: usize, L: Length<N> = FixedLength> {
    watched: Vec<Watched<'m, N, L>>,
    /// Whether a watched function depends on the velocity. Functions of a Hamiltonian depend on the momentum instead.
    needs_velocity: bool,
    pub(super) seen: Seen,
    /// Events at the time of the last cut, or missed before it, that are still to be met.
    due: VecDeque<Crossed>,
    rooms: Buffers,
    clear: Clear,
    pub(super) met: Vec<Event<N, L>>,
    /// The events in the last element that did not end it.
    recorded: Vec<Place>,
    /// The number of cuts in the current step since a time, at which counting has begun.
    cuts: u32,
    since: f64,
    /// The length of the current step.
    step: f64,
    /// The times from which on functions were found to be NaN.
    undefined: Vec<Option<f64>>,
}

impl<const N: usize, L: Length<N>> fmt::Debug for Events<'_, N, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.watched.iter().map(|watched| &watched.on);
        f.debug_list().entries(names).finish()
    }
}

/// Buffers for all outputs: values, bounds, and bounds with derivatives.
struct Buffers {
    values: RefCell<Vec<f64>>,
    bounds: RefCell<Vec<Enclosure>>,
    slopes: RefCell<Vec<Dual<Enclosure>>>,
}

impl Buffers {
    fn new(columns: usize) -> Self {
        let zero = Dual::new(Enclosure::ZERO, Enclosure::ZERO);
        Self {
            values: RefCell::new(vec![0.0; columns]),
            bounds: RefCell::new(vec![Enclosure::ZERO; columns]),
            slopes: RefCell::new(vec![zero; columns]),
        }
    }
}

/// A solved element in which events are looked for.
pub(super) struct Passage<'a, const N: usize, L: Length<N> = FixedLength> {
    pub(super) t: f64,
    /// The time at which the force is first evaluated: `t`, or a few ulps after it if `t` is a break.
    pub(super) begin: f64,
    pub(super) h: f64,
    pub(super) before: &'a L::State,
    pub(super) after: &'a L::State,
    pub(super) dense: &'a L::Polynomial,
    pub(super) impulses: &'a [Impulse<N>],
}

impl<'a, const N: usize, L: Length<N>> Passage<'a, N, L> {
    pub(super) fn origin(&self) -> Origin<'a, N, L> {
        Origin {
            t: self.t,
            begin: self.begin,
            before: self.before,
            impulses: self.impulses,
        }
    }

    /// The distance below which two times in the element are equal.
    fn resolution(&self) -> f64 {
        let (start, end) = (self.t, self.t + self.h);
        4.0 * f64::EPSILON * start.abs().max(end.abs()).max(self.h.abs())
    }

    /// The time at a distance from the start of the element; that of a node if they differ by rounding only.
    fn time(&self, length: f64, resolution: f64) -> f64 {
        if (self.h - length).abs() <= resolution {
            self.dense.end()
        } else if length.abs() <= resolution {
            self.t
        } else {
            self.t + length
        }
    }
}

/// The start of an element that an event has cut.
pub(super) struct Origin<'a, const N: usize, L: Length<N> = FixedLength> {
    pub(super) t: f64,
    /// As in a [`Passage`].
    pub(super) begin: f64,
    pub(super) before: &'a L::State,
    pub(super) impulses: &'a [Impulse<N>],
}

/// The place of an event in an element.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The index of the event among those watched.
    watched: usize,
    /// The index among the events met so far.
    met: usize,
    /// The length of the element that ends at the event.
    length: f64,
    /// False for an event at the start of the element.
    inside: bool,
}

/// An element that was shortened to end at an event.
pub(super) struct Cut<const N: usize, L: Length<N> = FixedLength> {
    pub(super) t: f64,
    pub(super) at: L::State,
    pub(super) inside: Option<L::Polynomial>,
    /// How the run continues; `None` if it ends here.
    pub(super) after: Option<After<N, L>>,
    place: Place,
}

/// An event in an element, with the element as planned; followers compute derivatives from it.
pub struct Severed<'a, 'm, const N: usize, L: Length<N> = FixedLength> {
    /// The start of the element.
    pub(super) start: f64,
    /// The time at which the force is first evaluated: `start`, or a few ulps after it if `start` is a break.
    pub(super) begin: f64,
    pub(super) length: f64,
    /// The planned length of the element.
    pub(super) step: f64,
    pub(super) before: &'a L::State,
    pub(super) impulses: &'a [Impulse<N>],
    /// False for an event at the start of the element.
    pub(super) inside: bool,
    pub(super) watched: &'a Watched<'m, N, L>,
    /// The index of the event among those watched.
    pub(super) which: usize,
    pub(super) event: &'a Event<N, L>,
    /// The index of the event among those met so far.
    pub(super) number: usize,
    pub(super) goes_on: bool,
}

/// The result of the action at an event that ends an element.
struct Done<const N: usize, L: Length<N>> {
    place: Place,
    /// How the run continues; `None` if it ends here.
    after: Option<After<N, L>>,
}

impl<'m, const N: usize, L: Length<N>> Events<'m, N, L> {
    /// After this number of events in one step it is examined whether they accumulate (Zeno behaviour): whether the mean
    /// time between them is [`SOON`](Self::SOON).
    const MAX_CUTS: u32 = 1000;

    /// Events also accumulate if one recurs this soon, relative to the step: later ones are lost in rounding error.
    const SOON: f64 = 1e-6;

    /// The model or its inputs have changed. Known signs stay, so that a function that jumps over zero by a change of
    /// inputs is met at once.
    pub(super) fn forget_bounds(&mut self) {
        self.clear.forget();
    }

    /// Begins a new step of the run.
    pub(super) fn begin(&mut self, step: f64) {
        (self.cuts, self.step) = (0, step);
        self.due.clear();
    }

    /// Whether bounds prove that no watched function vanishes in the last element; cheaper than its polynomial.
    pub(super) fn stays_clear(
        &mut self,
        run: &mut dyn Searched<N, L>,
        element: (f64, f64),
    ) -> bool {
        let within = |bounds: &[(f64, f64)]| run.reaches_within(bounds);
        (self.clear.holds(element, within) || self.look_about(run, element))
            && self.clear.agree(&mut self.seen.sides)
    }

    #[cold]
    fn look_about(&mut self, run: &mut dyn Searched<N, L>, element: (f64, f64)) -> bool {
        let has_begun =
            !self.has_functions() && (self.clear).begin(element, &mut |reached| run.reach(reached));
        if !has_begun {
            return false;
        }
        let (watched, mut values) = (&self.watched, self.rooms.bounds.borrow_mut());
        self.clear.look(element, &mut |bounds, sides| {
            if !run.outputs_within(bounds, &mut values) {
                return false;
            }
            sides.extend(watched.iter().map(|watched| match watched.value {
                Value::Column(column) => values[column].side(),
                Value::Function(_) => 0.0,
            }));
            true
        })
    }

    /// Whether events at the time of the last cut are to be met before the run continues.
    pub(super) fn has_due(&self) -> bool {
        !self.due.is_empty()
    }

    /// Applies the actions at the events in an element, in the order of time, up to the first that ends the element.
    pub(super) fn pass(
        &mut self,
        run: &mut dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
    ) -> Result<Option<Cut<N, L>>, RunErrorKind> {
        self.recorded.clear();
        if self.stays_off(run, arc.dense) {
            return Ok(None);
        }
        let resolution = arc.resolution();
        let found = self.crossings(run, arc, resolution);
        let mut remaining = Remaining::new(found.roots, found.sides);
        if self.has_impacts() {
            let rows = [0.0, 1.0].map(|tau| self.row_at(run.model(), arc, tau));
            self.check_impacts(&remaining, &rows, arc.t + arc.h)?;
        }
        let mut is_begun: Vec<bool> = self.seen.sides.iter().map(|side| *side != 0.0).collect();
        loop {
            let waiting = (&mut remaining, &mut is_begun[..]);
            let Some((root, met)) = self.next_event(run, arc, waiting, resolution) else {
                break;
            };
            let meeting = self.meeting(arc, &remaining, (&root, &met), resolution);
            for number in 0..meeting.together.len() {
                let crossed = meeting.together[number];
                remaining.take(crossed.function);
                let at = (met.time, &met.state, &met.velocity);
                let place = (met.length, met.inside.is_some());
                let Some(Done { place, after }) = self.meet(run, crossed, at, place)? else {
                    continue;
                };
                self.leave(run, (meeting, number), &met, after.as_ref());
                return Ok(Some(Cut {
                    t: met.time,
                    at: met.state,
                    inside: met.inside,
                    after,
                    place,
                }));
            }
        }
        self.seen.sides = remaining.into_sides();
        self.note_undefined(&found.undefined, |tau| arc.t + tau * arc.h);
        Ok(None)
    }

    /// The changes of sign of the watched functions on the polynomial of an element.
    fn crossings(
        &self,
        run: &dyn Searched<N, L>,
        arc: &Passage<'_, N, L>,
        resolution: f64,
    ) -> search::Crossings {
        let model = run.model();
        let roundings = self.roundings(model, (arc.t, arc.before));
        search::crossings(
            (&self.seen.sides, &roundings),
            (2 * arc.dense.degree()).clamp(8, 24),
            resolution / arc.h.abs(),
            &|tau, row| self.write_row_at(model, arc, tau, row),
            &mut |function, part| self.course(run, arc.dense, function, part),
        )
    }

    /// Applies the action at an event that ends an element of a given length; `None` if it was only recorded.
    fn meet(
        &mut self,
        run: &mut dyn Searched<N, L>,
        Crossed { function, rises }: Crossed,
        (time, state, velocity): (f64, &L::State, &L::Vector),
        (length, inside): (f64, bool),
    ) -> Result<Option<Done<N, L>>, RunErrorKind> {
        let Watched { on, value } = &self.watched[function];
        let (q, p) = L::parts(state);
        let event = Event {
            name: on.name.clone(),
            t: time,
            q: q.clone(),
            v: velocity.clone(),
            p: p.clone(),
            rises,
        };
        let (act, impact) = act::act(run.model(), (on, value), &event);
        let goes_by = act == Act::Record;
        let after = act::after(run, &event, act);
        let place = Place {
            watched: function,
            met: self.met.len(),
            length,
            inside,
        };
        let name = event.name.clone();
        self.met.push(event);
        let after = after?;
        if goes_by {
            self.recorded.push(place);
            return Ok(None);
        }
        let are_dense = self.count_cut(time);
        let is_it = |last: LastCut| last.function == function && self.is_soon(last.time, time);
        let returns = after.is_some() && self.seen.last.is_some_and(is_it);
        let is_idle = |after: &After<N, L>| after.set.is_none() && after.state == *state;
        let is_idle = after.as_ref().is_some_and(is_idle);
        let last = Some(LastCut {
            time,
            function,
            rises,
            is_idle,
            impact: if is_idle { 0.0 } else { impact },
        });
        (self.seen.last, self.seen.lasts[function]) = (last, last);
        if returns || are_dense {
            return Err(RunErrorKind::EventsWithoutEnd { name, time });
        }
        Ok(Some(Done { place, after }))
    }

    /// Counts a cut; whether cuts of the current step accumulate.
    fn count_cut(&mut self, time: f64) -> bool {
        if self.cuts == 0 || self.cuts > Self::MAX_CUTS {
            (self.cuts, self.since) = (0, time);
        }
        self.cuts += 1;
        let least = f64::from(Self::MAX_CUTS) * Self::SOON * self.step.abs();
        self.cuts > Self::MAX_CUTS && (time - self.since).abs() < least
    }

    /// Whether this is the last event, seen again because the polynomial starts with another velocity than the node.
    fn is_seen_again(
        &self,
        model: &dyn EventModel<N, L>,
        arc: &Passage<'_, N, L>,
        root: &search::Root,
        time: f64,
    ) -> bool {
        let last = self.last_of(root.into(), time);
        last.is_some_and(|last| last.is_idle || self.begins_behind(model, arc, root))
    }

    /// Whether the root exists only because the polynomial starts before the zero, while the node is already beyond it.
    fn begins_behind(
        &self,
        model: &dyn EventModel<N, L>,
        arc: &Passage<'_, N, L>,
        root: &search::Root,
    ) -> bool {
        let before = if root.rises { -1.0 } else { 1.0 };
        let value = |state: &L::State, time: f64, v: &L::Vector| {
            before * self.row(model, (time, state, v))[root.function]
        };
        let inside = |part: f64| {
            let time = arc.t + part * root.tau * arc.h;
            let state = arc.dense.at_time(time);
            value(&state, time, &arc.dense.velocity_at_time(time))
        };
        let (begin, middle) = (inside(0.0), inside(0.5));
        let guess = arc.dense.velocity_at_time(arc.t);
        let Some(v) = model.velocity(arc.t, arc.before, &guess) else {
            return false;
        };
        begin > 0.0 && middle < begin && value(arc.before, arc.t, &v) < 0.5 * begin
    }

    /// Whether the time between two events is so short that they are taken to accumulate.
    fn is_soon(&self, last: f64, time: f64) -> bool {
        (time - last).abs() < Self::SOON * self.step.abs()
    }

    /// A cut with the data from which its derivatives are computed.
    pub(super) fn severed<'c>(
        &'c self,
        origin: &Origin<'c, N, L>,
        cut: &Cut<N, L>,
    ) -> Severed<'c, 'm, N, L> {
        self.place(origin, &cut.place, cut.after.is_some())
    }

    /// The events of the last element that did not end it.
    pub(super) fn gone_by<'c>(
        &'c self,
        origin: &'c Origin<'c, N, L>,
    ) -> impl Iterator<Item = Severed<'c, 'm, N, L>> {
        (self.recorded.iter()).map(move |place| self.place(origin, place, true))
    }

    fn place<'c>(
        &'c self,
        origin: &Origin<'c, N, L>,
        place: &Place,
        goes_on: bool,
    ) -> Severed<'c, 'm, N, L> {
        let event = &self.met[place.met];
        let count = acting::behind(origin.impulses, event.t, self.step);
        Severed {
            start: origin.t,
            begin: origin.begin,
            length: place.length,
            step: self.step,
            before: origin.before,
            impulses: &origin.impulses[..count],
            inside: place.inside,
            watched: &self.watched[place.watched],
            which: place.watched,
            event,
            number: place.met,
            goes_on,
        }
    }

    fn has_functions(&self) -> bool {
        self.watched.iter().any(Watched::is_function)
    }
}
